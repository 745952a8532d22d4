// Drives the viewer in a real browser: `node tools/viewer/test.mjs target/debug/halflight [screenshot.png]`.
//
// Opens a demo, sees a picture, drags camera and light, switches technique, wipes, asks why a pixel is as it is, saves an
// EXR, opens a dropped file. Exit code 0: all of that works; 77: there is no browser here; else what failed is printed.

import { spawn } from "node:child_process";
import { existsSync, mkdtempSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import path from "node:path";

const [program, screenshot] = process.argv.slice(2);
const browserPath = [process.env.CHROMIUM, "/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"].find((p) => p && existsSync(p));
let chromium;
try {
  ({ chromium } = await import("playwright-core"));
} catch {
  console.log("skipped: playwright-core is not installed (npm ci in tools/viewer)");
  process.exit(77);
}
if (!browserPath) {
  console.log("skipped: there is no Chromium here (set CHROMIUM to its path)");
  process.exit(77);
}

const folder = mkdtempSync(path.join(tmpdir(), "halflight-viewer-"));
const server = spawn(program, ["view", "demo:cone-man", "--port", "0", "--no-browser", "--folder", folder, "--json", "--set", "image.size=[320,180]"], { stdio: ["ignore", "pipe", "inherit"] });
const url = await new Promise((resolve, reject) => {
  let said = "";
  server.stdout.on("data", (chunk) => {
    said += chunk;
    const found = said.match(/http:\/\/[^"\s]+/);
    if (found) resolve(found[0]);
  });
  server.on("exit", (code) => reject(new Error(`the viewer ended with ${code}: ${said}`)));
});

const browser = await chromium.launch({
  executablePath: browserPath,
  args: ["--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking", "--disable-component-update", "--disable-sync"],
});
const page = await browser.newPage({ viewport: { width: 1360, height: 860 }, acceptDownloads: true });
const complaints = [];
page.on("pageerror", (error) => complaints.push(String(error)));
page.on("console", (said) => { if (said.type() === "error") complaints.push(said.text()); });

// The mean of each colour and their spread, over the canvas.
const look = () => page.evaluate(() => {
  const canvas = document.getElementById("picture");
  const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
  const sums = [0, 0, 0];
  let squares = 0;
  for (let i = 0; i < data.length; i += 4) for (let c = 0; c < 3; c++) { sums[c] += data[i + c]; squares += data[i + c] ** 2; }
  const count = data.length / 4;
  const mean = sums.map((sum) => sum / count);
  return { mean, spread: Math.sqrt(squares / count / 3 - mean.reduce((a, b) => a + b * b, 0) / 3), sample: Array.from(data.filter((_, i) => i % 397 === 0)) };
});
const apart = (a, b) => a.sample.reduce((sum, value, i) => sum + Math.abs(value - b.sample[i]), 0) / a.sample.length;
const still = async () => {
  await page.waitForFunction(() => window.halflight.headers.a && !window.halflight.headers.a.moving && window.halflight.headers.a.samples >= 4, null, { timeout: 120000 });
  await page.waitForTimeout(150);
  return look();
};
const check = (fact, words) => { if (!fact) throw new Error(words); console.log(`ok: ${words}`); };

try {
  await page.goto(url);
  const first = await still();
  check(Math.max(...first.mean) > 20 && first.spread > 5, "the first picture is not black");

  const box = await page.locator("#picture").boundingBox();
  const drag = async (dx, dy, key) => {
    await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
    if (key) await page.keyboard.down(key);
    await page.mouse.down();
    for (let i = 1; i <= 8; i++) { await page.mouse.move(box.x + box.width / 2 + dx * i / 8, box.y + box.height / 2 + dy * i / 8); await page.waitForTimeout(30); }
    await page.mouse.up();
    if (key) await page.keyboard.up(key);
    await page.waitForTimeout(200);
  };
  await drag(120, 20);
  const turned = await still();
  check(apart(first, turned) > 3, "dragging turns the camera");
  await drag(150, 0, "Control");
  const relit = await still();
  check(apart(turned, relit) > 1, "dragging with Ctrl turns the light");
  await page.keyboard.press("ArrowLeft");
  await page.waitForTimeout(200);
  check(apart(relit, await still()) > 0.5, "the arrow keys turn the camera");
  await page.keyboard.press("h");

  await page.selectOption("#technique-a", "path");
  await page.waitForFunction(() => window.halflight.headers.a?.technique === "path");
  await still();
  check((await page.textContent("#name-a")) === "path", "the technique is switched");

  await page.selectOption("#technique-a", "shexp");
  await page.waitForFunction(() => window.halflight.headers.a?.technique === "shexp");
  await page.click("#compare");
  await page.waitForFunction(() => window.halflight.headers.b && !window.halflight.headers.b.moving, null, { timeout: 120000 });
  check(await page.isVisible("#wipe"), "two sides are shown with a border between them");
  await page.focus("#wipe");
  await page.keyboard.press("ArrowLeft");
  check((await page.getAttribute("#wipe", "aria-valuenow")) === "48", "the border moves by the keys");
  await page.waitForFunction(() => /FLIP/.test(document.getElementById("errors").textContent), null, { timeout: 120000 });
  check(true, "the error between the sides is measured");
  if (screenshot) {
    await page.waitForFunction(() => window.halflight.headers.b?.samples >= 128, null, { timeout: 120000 });
    await page.focus("#picture");
    await page.screenshot({ path: screenshot });
  }
  await page.selectOption("#layer", "flip");
  await page.waitForFunction(() => window.halflight.images.map, null, { timeout: 120000 });
  check(true, "the FLIP map is shown");
  await page.selectOption("#layer", "normal");
  await page.waitForTimeout(500);
  await page.selectOption("#layer", "color");
  await page.click("#compare");

  await page.mouse.click(box.x + box.width / 2, box.y + box.height * 0.7);
  await page.waitForSelector("#explanation:not([hidden])");
  const text = await page.textContent("#explain-text");
  check(/material/.test(text) && /depth/.test(text) && !/\b0 samples/.test(text), "a pixel is explained");
  const card = await page.locator("#explanation").boundingBox();
  check(card.y >= 0 && card.y + 60 < 860, "the explanation is in sight");
  await page.selectOption("#technique-a", "covariance");
  await page.waitForFunction(() => window.halflight.headers.a?.technique === "covariance", null, { timeout: 60000 });
  await page.mouse.click(box.x + box.width / 2, box.y + box.height * 0.8);
  await page.waitForFunction(() => /paths/.test(document.getElementById("explain-text").textContent), null, { timeout: 60000 });
  check(true, "covariance says why");
  await page.selectOption("#technique-a", "shexp");
  await page.waitForFunction(() => window.halflight.headers.a?.technique === "shexp");

  const download = page.waitForEvent("download", { timeout: 120000 });
  await page.click("#save-exr");
  const saved = path.join(folder, "saved.exr");
  await (await download).saveAs(saved);
  check(readFileSync(saved).readUInt32LE(0) === 20000630, "an EXR is saved");
  const info = spawn(program, ["info", saved], { stdio: ["ignore", "pipe", "inherit"] });
  const code = await new Promise((resolve) => info.on("exit", resolve));
  check(code === 0, "the saved EXR loads");

  await page.setInputFiles("#files", [
    { name: "tri.obj", mimeType: "text/plain", buffer: Buffer.from("mtllib tri.mtl\nusemtl red\nv -1 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n") },
    { name: "tri.mtl", mimeType: "text/plain", buffer: Buffer.from("newmtl red\nKd 1 0 0\n") },
  ]);
  await page.waitForFunction(() => window.halflight.state.scene === "tri.obj");
  check(true, "a model and its materials are opened together");
  const ball = 'environment = "studio"\n[camera]\norigin = [0, 1, 4]\ntarget = [0, 0, 0]\nup = [0.2, 1, 0]\nkeyframes = [{ time = 0 }, { time = 2, origin = [3, 1, 2] }]\n[[shape]]\nname = "ball"\ntype = "sphere"\n';
  await page.setInputFiles("#files", [{ name: "ball.toml", mimeType: "text/plain", buffer: Buffer.from(ball) }]);
  await page.waitForFunction(() => window.halflight.state.scene === "ball.toml");
  check(true, "a dropped file is opened");

  const ask = (wish) => page.evaluate((wish) => ask(wish), wish);
  // What is shown is of the state that was told last.
  const settled = async () => {
    await page.waitForTimeout(300);
    await page.waitForFunction(() => { const { state, headers } = window.halflight; return headers.a.moment === state.moment && !headers.a.moving; }, null, { timeout: 60000 });
    return still();
  };
  const before = await settled();
  await ask({ do: "time", seconds: 2 });
  await page.waitForFunction(() => window.halflight.state.seconds === 2);
  check(apart(before, await settled()) > 1, "time moves the camera as the scene says");
  await page.keyboard.press("ArrowLeft");
  await page.waitForFunction(() => !window.halflight.state.follows);
  await still();
  await page.keyboard.press("h");
  await page.waitForFunction(() => window.halflight.state.follows);
  check(true, "home follows the scene's camera again");
  await page.fill("#material", "copper");
  await page.press("#material", "Enter");
  await page.waitForFunction(() => window.halflight.state.materials.length === 1);
  await page.fill("#material", "nonsense");
  await page.press("#material", "Enter");
  await page.waitForFunction(() => document.getElementById("material").value === "copper");
  check(await page.isVisible("#message"), "a material that is refused is taken back");
  await ask({ do: "environment", degrees: 90 });
  await ask({ do: "move", object: "ball", by: [0, 0.25, 0] });
  await page.click("#keep");
  await page.waitForFunction(() => /ball-view\.toml/.test(document.getElementById("message").textContent));
  const kept = readFileSync(path.join(folder, "ball-view.toml"), "utf8");
  check(/keyframes/.test(kept) && /up = /.test(kept) && /rotation_degrees = 90/.test(kept) && /copper/.test(kept) && /0\.25/.test(kept), "a kept scene has the camera's motion, the turned light, the material and the moved object");

  await page.setInputFiles("#files", [{ name: "saved.exr", mimeType: "image/x-exr", buffer: readFileSync(saved) }]);
  await page.click("#dropped button[value=compare]");
  await page.waitForFunction(() => window.halflight.headers.b?.technique === "saved.exr");
  await page.waitForFunction(() => /against saved.exr: relMSE/.test(document.getElementById("errors").textContent), null, { timeout: 60000 });
  check(true, "a stored picture is compared with");
  await page.click("#compare");

  await page.focus("#picture");
  await page.keyboard.press("g");
  for (let i = 0; i < 3; i++) await page.keyboard.press("ArrowDown");
  await page.keyboard.press("x");
  await page.waitForFunction(() => /samples?/.test(document.getElementById("explain-text").textContent));
  check(await page.isVisible("#marker"), "a pixel is explained by keys, with a mark where it is");
  await page.keyboard.press("Escape");
  const watcher = await browser.newPage({ viewport: { width: 390, height: 800 } });
  await watcher.goto(url);
  await watcher.waitForFunction(() => window.halflight.headers.a);
  check(await watcher.isVisible("#watching") && await watcher.isDisabled("#technique-a"), "a window without the controls says so");
  const header = await watcher.locator("header").boundingBox();
  check(header.height < 50, "the header is one row on a narrow screen");
  await watcher.close();
  await page.selectOption("#scene", "demo:moving");
  await page.waitForFunction(() => window.halflight.state.scene === "demo:moving", null, { timeout: 60000 });
  check(await page.isVisible("#timeline"), "another scene is opened, with its time");
  await page.selectOption("#technique-a", "prt");
  await page.waitForFunction(() => /preparing prt/.test(document.getElementById("busy").textContent) && !document.getElementById("busy").hidden, null, { timeout: 5000 });
  await page.selectOption("#technique-a", "path");
  await page.waitForFunction(() => window.halflight.headers.a?.technique === "path", null, { timeout: 20000 });
  check(true, "a technique that prepares for long says so, and another choice ends it");
  check(complaints.length === 0, `the page has no complaints ${complaints.join("; ")}`);
} finally {
  await browser.close();
  server.removeAllListeners("exit");
  server.kill("SIGINT");
  rmSync(folder, { recursive: true, force: true });
}
