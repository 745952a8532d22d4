// How long the viewer takes from a hand's motion to a new picture: `node tools/viewer/latency.mjs target/release/halflight`.
//
// Turns the camera again and again in a real browser, one motion after the picture of the last, and prints for each
// technique and size the median and the 95th percentile of input to picture on the canvas, how long encoding took, and
// pictures a second while moving. Nothing else should run on the machine.

import { spawn } from "node:child_process";
import { existsSync } from "node:fs";
import { chromium } from "playwright-core";

const program = process.argv[2];
const browserPath = [process.env.CHROMIUM, "/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"].find((p) => p && existsSync(p));
const browser = await chromium.launch({ executablePath: browserPath, args: ["--headless", "--no-sandbox", "--disable-gpu"] });
const MOTIONS = 12;

for (const [demo, technique] of [["three-paints", "bandwidth"]]) {
  for (const [width, height] of [[640,360]]) {
    const server = spawn(program, ["view", `demo:${demo}`, "-t", technique, "--port", "0", "--no-browser", "--json", "--set", `image.size=[${width},${height}]`], { stdio: ["ignore", "pipe", "inherit"] });
    const url = await new Promise((resolve) => {
      let said = "";
      server.stdout.on("data", (chunk) => { const found = (said += chunk).match(/http:\/\/[^"\s]+/); if (found) resolve(found[0]); });
    });
    const page = await browser.newPage({ viewport: { width: 1360, height: 860 } });
    await page.goto(url);
    await page.waitForFunction((name) => window.halflight.headers.a?.technique === name && window.halflight.headers.a.samples >= 4, technique, { timeout: 120000 });
    const box = await page.locator("#picture").boundingBox();
    const place = (i) => [box.x + box.width * (0.4 + 0.2 * ((i * 7) % 20) / 20), box.y + box.height / 2];
    await page.mouse.move(...place(0));
    await page.mouse.down();
    const times = [], encodings = [], shown = [];
    const begun = Date.now();
    for (let i = 1; i <= MOTIONS; i++) {
      await page.evaluate(() => { window.halflight.latency = null; });
      await page.mouse.move(...place(i));
      await page.waitForFunction(() => window.halflight.latency != null, null, { polling: 1, timeout: 20000 });
      const found = await page.evaluate(() => ({ latency: window.halflight.latency, encode: window.halflight.state?.encode_milliseconds, width: window.halflight.headers.a.width }));
      console.log(found.latency, found.width, JSON.stringify(await page.evaluate(()=>({a: window.halflight.headers.a, s: window.halflight.state}))).slice(0,1500)); times.push(found.latency); encodings.push(found.encode ?? 0); shown.push(found.width);
    }
    const seconds = (Date.now() - begun) / 1000;
    await page.mouse.up();
    const at = (values, share) => [...values].sort((a, b) => a - b)[Math.floor(share * (values.length - 1))];
    console.log(`${technique} ${width}x${height}: ${at(times, 0.5).toFixed(0)} ms in the median, ${at(times, 0.95).toFixed(0)} ms at 95 %; encoding ${at(encodings, 0.5).toFixed(1)} ms; ${(MOTIONS / seconds).toFixed(1)} pictures/s, ${at(shown, 0.5)} columns while moving`);
    await page.close();
    server.kill("SIGINT");
  }
}
await browser.close();
