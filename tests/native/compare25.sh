#!/bin/sh
# compare25.sh ROOT RTC_RUN: rtc-run --compare draws the picture of testdata/shaders/run by rtc and by Mesa 25's
# lavapipe's own ray tracing; it must name the driver, have run both, and find no texel that differs.
set -eu
if ! "$1/tools/install-lavapipe25" --check; then
  echo "SKIP: Mesa 25's lavapipe is not there (tools/install-lavapipe25 fetches it)"
  exit 77
fi
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
shaders="$1/testdata/shaders/run"
"$1/tools/install-lavapipe25" --run "$2" "$shaders/hello.rgen" "$shaders/hello.rchit" "$shaders/hello.rmiss" \
  --size 64x64 --native khr --compare --device llvmpipe -o "$folder/picture.png" >"$folder/log" 2>&1 || {
  cat "$folder/log"
  exit 1
}
cat "$folder/log"
grep -q '^device: llvmpipe.* Mesa 25' "$folder/log"
grep -q '^rtc: pipeline' "$folder/log"
grep -q '^native KHR: pipeline' "$folder/log"
grep -q '64x64: 0 of 4096 differ' "$folder/log"
test -s "$folder/picture.png"
