#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>

#include "reflect/reflection_io.h"
#include "sample.h"

using ::testing::HasSubstr;

namespace {

size_t chunks_in(const std::vector<uint32_t>& words) {
    std::string text;
    spvtools::SpirvTools(SPV_ENV_UNIVERSAL_1_3).Disassemble(words, &text, SPV_BINARY_TO_TEXT_OPTION_NONE);
    size_t count = 0;
    for (size_t at = text.find("\"rtc.reflection:"); at != std::string::npos;
         at = text.find("\"rtc.reflection:", at + 1))
        ++count;
    return count;
}

rtc::Reflection big_reflection() {
    rtc::Reflection r = sample_reflection();
    for (int i = 0; i < 2000; ++i)
        r.resources.push_back({"resource number " + std::to_string(i), "camera", 1, static_cast<uint32_t>(i),
                               "storage-buffer", 1});
    return r;
}

TEST(Embed, GoesInAndComesOut) {
    std::vector<uint32_t> module = sample_module();
    rtc::embed_reflection(module, sample_reflection());
    EXPECT_TRUE(spvtools::SpirvTools(SPV_ENV_VULKAN_1_1).Validate(module));
    std::string json;
    ASSERT_TRUE(rtc::extract_reflection_json(module, json));
    EXPECT_EQ(json, rtc::embedded_json(sample_reflection()));
    rtc::Reflection back;
    std::string error;
    ASSERT_TRUE(rtc::read_reflection(module, back, error)) << error;
    EXPECT_EQ(rtc::embedded_json(back), json);
    EXPECT_EQ(back.stages[0].file, "a.rgen");
}

TEST(Embed, LargeReflectionIsCutIntoChunks) {
    std::vector<uint32_t> module = sample_module();
    rtc::embed_reflection(module, big_reflection());
    EXPECT_GT(chunks_in(module), 3u);
    EXPECT_TRUE(spvtools::SpirvTools(SPV_ENV_VULKAN_1_1).Validate(module));
    for (size_t at = 5; at < module.size(); at += module[at] >> 16)
        EXPECT_LT((module[at] >> 16) * 4, 60u * 1024u);
    std::string json;
    ASSERT_TRUE(rtc::extract_reflection_json(module, json));
    EXPECT_EQ(json, rtc::embedded_json(big_reflection()));
}

TEST(Embed, ASecondTimeReplacesTheFirst) {
    std::vector<uint32_t> once = sample_module();
    rtc::embed_reflection(once, sample_reflection());
    std::vector<uint32_t> twice = sample_module();
    rtc::embed_reflection(twice, big_reflection());
    rtc::embed_reflection(twice, sample_reflection());
    EXPECT_EQ(chunks_in(twice), 1u);
    EXPECT_EQ(twice.size(), once.size());
    EXPECT_TRUE(spvtools::SpirvTools(SPV_ENV_VULKAN_1_1).Validate(twice));
}

// The layout a C reader relies on, byte by byte.
TEST(Embed, HeaderAndGroupsStandBeforeTheJson) {
    std::vector<uint32_t> module = sample_module();
    rtc::embed_reflection(module, sample_reflection());
    std::string text;
    spvtools::SpirvTools(SPV_ENV_UNIVERSAL_1_3).Disassemble(module, &text, SPV_BINARY_TO_TEXT_OPTION_NONE);
    const std::string prefix = "\"rtc.reflection:0/1:";
    const size_t begin = text.find(prefix);
    ASSERT_NE(begin, std::string::npos);
    const std::string base64 =
        text.substr(begin + prefix.size(), text.find('"', begin + 1) - begin - prefix.size());
    // 24 header words: their first three as base64 decode to "RTMF", the version and the flags.
    EXPECT_EQ(base64.substr(0, 16), "UlRNRgIAAAABAAAA");
    EXPECT_EQ(sizeof(RtcModuleHeader), 96u);
    EXPECT_EQ(sizeof(RtcModuleGroup), 36u);
}

TEST(Embed, OrderOfChunksDoesNotMatter) {
    std::vector<uint32_t> module = sample_module();
    rtc::embed_reflection(module, big_reflection());
    // Swap the first two chunks, which are of one size.
    std::vector<size_t> at;
    for (size_t i = 5; i < module.size(); i += module[i] >> 16)
        if ((module[i] & 0xffff) == 7 && module[i] >> 16 > 100) at.push_back(i);
    ASSERT_GT(at.size(), 2u);
    const size_t size = module[at[0]] >> 16;
    ASSERT_EQ(module[at[1]] >> 16, size);
    std::swap_ranges(module.begin() + static_cast<std::ptrdiff_t>(at[0]),
                     module.begin() + static_cast<std::ptrdiff_t>(at[0] + size),
                     module.begin() + static_cast<std::ptrdiff_t>(at[1]));
    std::string json;
    ASSERT_TRUE(rtc::extract_reflection_json(module, json));
    EXPECT_EQ(json, rtc::embedded_json(big_reflection()));
}

TEST(Embed, ModulesWithoutReflectionSaySo) {
    rtc::Reflection out;
    std::string error, json;
    EXPECT_FALSE(rtc::extract_reflection_json(sample_module(), json));
    EXPECT_FALSE(rtc::read_reflection(sample_module(), out, error));
    EXPECT_THAT(error, HasSubstr("carries no rtc reflection"));
    EXPECT_FALSE(rtc::read_reflection({}, out, error));
    EXPECT_FALSE(rtc::read_reflection({1, 2, 3, 4, 5, 6}, out, error));
}

TEST(Embed, DamageIsNoticed) {
    std::vector<uint32_t> module = sample_module();
    rtc::embed_reflection(module, big_reflection());
    rtc::Reflection out;
    std::string error;
    for (size_t size = 5; size < module.size(); size += 97) {
        const std::vector<uint32_t> cut(module.begin(), module.begin() + static_cast<std::ptrdiff_t>(size));
        rtc::read_reflection(cut, out, error);
    }
    int refused = 0, tried = 0;
    for (size_t i = 20; i < module.size() - 20; i += 211, ++tried) {
        std::vector<uint32_t> damaged = module;
        damaged[i] ^= 0x41424344;
        refused += !rtc::read_reflection(damaged, out, error);
    }
    EXPECT_GT(refused, tried * 9 / 10);
    // A chunk gone: none of the rest is believed.
    for (size_t i = 5; i < module.size(); i += module[i] >> 16)
        if ((module[i] & 0xffff) == 7 && module[i] >> 16 > 100) {
            const auto at = module.begin() + static_cast<std::ptrdiff_t>(i);
            module.erase(at, at + static_cast<std::ptrdiff_t>(*at >> 16));
            break;
        }
    EXPECT_FALSE(rtc::read_reflection(module, out, error));
    EXPECT_THAT(error, HasSubstr("damaged reflection"));
}

TEST(Embed, AnotherAbiVersionIsRefused) {
    std::vector<uint32_t> module = sample_module();
    rtc::embed_reflection(module, sample_reflection());
    // The version is the second header word: base64 characters 5 to 10 of the blob.
    auto* bytes = reinterpret_cast<char*>(module.data());
    char* at = std::strstr(bytes + 20, "UlRNR");
    for (char* p = bytes + 20; !at && p < bytes + module.size() * 4 - 8; ++p)
        if (std::memcmp(p, "UlRNRgIAAAAB", 12) == 0) at = p;
    ASSERT_NE(at, nullptr);
    std::memcpy(at, "UlRNRgMAAAAB", 12);
    rtc::Reflection out;
    std::string error;
    EXPECT_FALSE(rtc::read_reflection(module, out, error));
    EXPECT_THAT(error, HasSubstr("ABI version 3"));
}

TEST(Embed, AModuleThatIsNoneIsLeftAlone) {
    std::vector<uint32_t> words = {1, 2, 3};
    rtc::embed_reflection(words, sample_reflection());
    EXPECT_EQ(words, (std::vector<uint32_t>{1, 2, 3}));
}

}  // namespace
