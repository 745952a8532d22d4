#!/usr/bin/env bash
# Renders two frames of each scene of docs/techniques/shexp.md, by `shexp` and by the path tracer, and prints how far
# apart they are at order 4, the same light for both.
set -euo pipefail
cd "$(dirname "$0")/.."
halflight=${1:-target/release/halflight}
for scene in wrecking-ball whale-in-the-ocean cone-man; do
    for frame in 24 45; do
        time=$(awk "BEGIN { print $frame / 30 }")
        render=("$halflight" render "scenes/$scene.toml" --frame "$frame" --fps 30 --size 400x225)
        "${render[@]}" -t shexp --spp 16 -o "docs/images/$scene-$frame.shexp.png"
        "${render[@]}" -t path --max-depth 1 --spp 256 -o "docs/images/$scene-$frame.path.png"
        "$halflight" compare "scenes/$scene.toml" -t shexp --reference path:max_depth=1 --reference-spp 256 \
            --spp 16 --size 400x225 --time "$time" --no-report
    done
done
