#!/bin/sh
# lavapipe25.sh ROOT RTC_RUN CASES FILTER: the cases natively and by rtc, both on Mesa 25's lavapipe; both must pass.
set -eu
if ! "$1/tools/install-lavapipe25" --check; then
  echo "SKIP: Mesa 25's lavapipe is not there (tools/install-lavapipe25 fetches it)"
  exit 77
fi
exec "$1/tools/install-lavapipe25" --run "$2" --suite "$3" --filter "$4" --on khr,rtc-ext --device llvmpipe
