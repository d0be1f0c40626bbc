#!/usr/bin/env bash
# Install Chromium for the tests of pages, where there is no browser and the package manager may.
# Without one those tests are skipped, and the last lines of `make test` say so.
set -u
for name in chromium chromium-browser google-chrome google-chrome-stable; do
    command -v "$name" > /dev/null && exit 0
done
echo "Installing Chromium for the tests of pages ..."
as_root=""
[ "$(id -u)" = 0 ] || as_root="sudo -n"
quietly() { "$@" > /dev/null 2>&1; }
if command -v apt-get > /dev/null; then
    quietly $as_root apt-get update -qq \
        && quietly $as_root apt-get install -qq -y --no-install-recommends chromium && exit 0
elif command -v dnf > /dev/null; then
    quietly $as_root dnf install -qy chromium && exit 0
elif command -v brew > /dev/null; then
    quietly brew install --cask chromium && exit 0
fi
echo "No Chromium could be installed: the tests of pages will be skipped." >&2
