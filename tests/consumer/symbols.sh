#!/bin/sh
# symbols.sh STATIC SHARED: the shared runtime exports rtr* only; both ask nothing of their host but plain C.
set -eu
exported=$(nm -D --defined-only "$2" | awk '{print $3}' | sort -u)
defined=$(nm --defined-only "$1" | awk 'NF == 3 {print $3}' | sort -u)
undefined=$(nm -u "$1" | awk '$1 == "U" {print $2}' | sort -u)
undefined=$(printf '%s\n' "$defined" "$defined" "$undefined" | sort | uniq -u)
status=0
for symbol in $exported; do
  case $symbol in rtr*) ;; *) echo "exported: $symbol"; status=1 ;; esac
done
# C11's library, as gcc spells it (checked variants included), and the compiler's own helpers.
for symbol in $undefined; do
  case $symbol in
    malloc|calloc|realloc|free|aligned_alloc|abort|qsort|bsearch) ;;
    mem*|str*|__mem*_chk|__str*_chk|*snprintf*) ;;
    sqrt*|floor*|ceil*|fabs*|fmin*|fmax*|ldexp*|frexp*|nextafter*|round*|trunc*|log2*|exp2*|pow*) ;;
    __stack_chk_fail|_GLOBAL_OFFSET_TABLE_|__tls_get_addr) ;;
    *) echo "needs from its host: $symbol"; status=1 ;;
  esac
done
[ $status = 0 ] && echo "$(printf '%s\n' "$exported" | wc -l) symbols exported, all rtr*; needs only the C library"
exit $status
