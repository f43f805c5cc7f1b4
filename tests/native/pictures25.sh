#!/bin/sh
# pictures25.sh ROOT RTC_RENDER INTEGRATOR: curved mirrors by Mesa 25's lavapipe's own ray tracing and by rtc on it,
# every ray compared; exact arithmetic must find no wrong answer of rtc's, and the pictures must agree.
set -eu
if ! "$1/tools/install-lavapipe25" --check; then
  echo "SKIP: Mesa 25's lavapipe is not there (tools/install-lavapipe25 fetches it)"
  exit 77
fi
exec "$1/tools/install-lavapipe25" --run "$2" --scene builtin:spheres --integrator "$3" --width 80 --height 80 \
  --samples 1 --max-bounces 6 --native khr --compare --classify --quiet --validate --device llvmpipe
