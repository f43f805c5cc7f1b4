// The shared library beside the static one: same behaviour, and nothing but rtcc_* leaves it.
#include <dlfcn.h>
#include <elf.h>

#include <cstring>

#include "api_util.h"

namespace {

std::string file_bytes(const char* path) {
    std::ifstream stream(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

TEST(SharedLibrary, ExportsOnlyTheInterface) {
    const std::string bytes = file_bytes(RTC_SHARED_LIBRARY);
    ASSERT_GT(bytes.size(), sizeof(Elf64_Ehdr));
    Elf64_Ehdr header;
    std::memcpy(&header, bytes.data(), sizeof header);
    int exported = 0;
    for (int i = 0; i < header.e_shnum; ++i) {
        Elf64_Shdr section, strings;
        std::memcpy(&section, bytes.data() + header.e_shoff + i * sizeof section, sizeof section);
        if (section.sh_type != SHT_DYNSYM) continue;
        std::memcpy(&strings, bytes.data() + header.e_shoff + section.sh_link * sizeof strings,
                    sizeof strings);
        for (size_t at = 0; at < section.sh_size; at += sizeof(Elf64_Sym)) {
            Elf64_Sym symbol;
            std::memcpy(&symbol, bytes.data() + section.sh_offset + at, sizeof symbol);
            if (symbol.st_shndx == SHN_UNDEF) continue;
            const std::string name = bytes.data() + strings.sh_offset + symbol.st_name;
            EXPECT_EQ(name.substr(0, 5), "rtcc_") << name;
            ++exported;
        }
    }
    EXPECT_GT(exported, 50);
}

TEST(SharedLibrary, GivesTheSameBytesAsTheStaticOne) {
    void* library = dlopen(RTC_SHARED_LIBRARY, RTLD_NOW | RTLD_LOCAL);
    ASSERT_NE(library, nullptr) << dlerror();
    const auto function = [&](auto* signature, const char* name) {
        return reinterpret_cast<decltype(signature)>(dlsym(library, name));
    };
    const auto create = function(&rtcc_compiler_create, "rtcc_compiler_create");
    const auto release = function(&rtcc_compiler_release, "rtcc_compiler_release");
    const auto compile_stage_shared = function(&rtcc_compile_stage, "rtcc_compile_stage");
    const auto words = function(&rtcc_result_words, "rtcc_result_words");
    const auto count = function(&rtcc_result_word_count, "rtcc_result_word_count");
    const auto release_result = function(&rtcc_result_release, "rtcc_result_release");
    rtcc_compiler_t compiler = create();
    rtcc_result_t result =
        compile_stage_shared(compiler, RTCC_STAGE_AUTO, "a.rmiss", kMiss.data(), kMiss.size(), nullptr);
    const std::string bytes(reinterpret_cast<const char*>(words(result)), count(result) * 4);
    EXPECT_EQ(bytes, bytes_of(compile_stage(kMiss, "a.rmiss")));
    release_result(result);
    release(compiler);
    // Left open: glslang keeps thread-local pools that would outlive the code.
}

}  // namespace
