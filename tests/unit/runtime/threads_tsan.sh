#!/bin/sh
# threads_tsan.sh SOURCE BUILD CMAKE: builds the runtime and its tests with ThreadSanitizer and runs those that
# record in several threads. What is not instrumented (the driver, the validation layers) is left out.
set -eu
"$3" -S "$1" -B "$2" -G Ninja -DCMAKE_BUILD_TYPE=RelWithDebInfo -DRTC_SANITIZE=thread \
  -DRTC_BUILD_COMPILER=OFF -DRTC_BUILD_TOOLS=OFF -DRTC_BUILD_TESTS=ON
"$3" --build "$2" --target test_runtime
TSAN_OPTIONS="suppressions=$1/tests/unit/runtime/tsan.supp ignore_noninstrumented_modules=1 exitcode=66" \
  "$2/bin/test_runtime" --gtest_filter='*Threads*'
