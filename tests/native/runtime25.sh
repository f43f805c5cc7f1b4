#!/bin/sh
# runtime25.sh ROOT PROGRAM: the runtime's API tests on Mesa 25's lavapipe (ctest runs each of them on the system's driver).
set -eu
if ! "$1/tools/install-lavapipe25" --check; then
  echo "SKIP: Mesa 25's lavapipe is not there (tools/install-lavapipe25 fetches it)"
  exit 77
fi
exec "$1/tools/install-lavapipe25" --run "$2" --gtest_brief=1
