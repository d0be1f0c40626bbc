#!/usr/bin/env bash
# The browser that the tests of pages drive, from the system's packages, where there is none yet.
# Without it those tests are skipped and say so.
set -u
for name in chromium chromium-browser google-chrome google-chrome-stable; do
    command -v "$name" > /dev/null && exit 0
done
if command -v apt-get > /dev/null && [ "$(id -u)" = 0 ]; then
    { apt-get update -qq && apt-get install -qq -y --no-install-recommends chromium; } > /dev/null 2>&1 \
        && exit 0
fi
echo "no Chromium could be installed: the tests of pages will be skipped" >&2
