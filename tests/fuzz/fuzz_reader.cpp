// libFuzzer target of the SPIR-V reader: the input's bytes behind the first (see fuzz_link.cpp) are a module.
// Reading may fail with a message, never crash, hang or allocate without bound; and what was read and written
// again reads back as the same words.
#include <cstdlib>

#include "fuzz_words.h"
#include "ir/module.h"

namespace {

using rtc::fuzz::Words, rtc::fuzz::words_of;

// Written, read and written again: what the writer made of a read module, the reader takes.
Words again(const Words& words, bool debug) {
    try {
        return rtc::ir::write_module(rtc::ir::read_module(words, "fuzz"), debug);
    } catch (const rtc::ir::CompileError&) {
        std::abort();
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    if (size < 1) return 0;
    try {
        const rtc::ir::Module module = rtc::ir::read_module(words_of(data, size), "fuzz");
        const Words once = rtc::ir::write_module(module, false);
        if (once != again(once, false)) std::abort();
        // With debug information, file names get new ids each time, and those that no line uses are dropped once.
        if (module.bound + 2 * module.files.size() > 0x3fffff) return 0;
        const Words first = again(rtc::ir::write_module(module, true), true);
        if (first.size() != again(first, true).size()) std::abort();
    } catch (const rtc::ir::CompileError&) {
    }
    return 0;
}
