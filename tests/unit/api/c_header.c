/* The header must be C, and usable before anything else is included. */
#include "rtc/compiler.h"

int c_header_round_trip(void);

int c_header_round_trip(void) {
    rtcc_compiler_t compiler = rtcc_compiler_create();
    const char source[] = "void main() {}";
    rtcc_result_t result =
        rtcc_compile_stage(compiler, RTCC_STAGE_MISS, "c.rmiss", source, sizeof source - 1, NULL);
    const rtcc_diagnostic message = rtcc_result_diagnostic(result, 0);
    const int ok = rtcc_result_status(result) == RTCC_STATUS_COMPILATION_ERROR && message.line == 1 &&
                   rtcc_abi_version() == RTC_ABI_VERSION;
    rtcc_result_release(result);
    rtcc_compiler_release(compiler);
    return ok;
}
