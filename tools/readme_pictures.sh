#!/usr/bin/env bash
# Renders the pictures of the README from the built-in demo scenes.
set -euo pipefail
cd "$(dirname "$0")/.."
halflight=${1:-target/release/halflight}
for name in still-life terrain cornell-box depth-of-field moving; do
    "$halflight" render "scenes/$name.toml" --spp 1024 -o "docs/images/$name.png"
done
