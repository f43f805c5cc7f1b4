#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "reflect/reflection_io.h"
#include "sample.h"

using ::testing::HasSubstr;
using ::testing::Not;

namespace {

TEST(Json, RoundTripsEveryMember) {
    const std::string first = rtc::reflection_to_json(sample_reflection());
    rtc::Reflection back;
    std::string error;
    ASSERT_TRUE(rtc::reflection_from_json(first, back, error)) << error;
    EXPECT_EQ(rtc::reflection_to_json(back), first);

    const rtc::Reflection r = sample_reflection();
    EXPECT_EQ(back.identity, r.identity);
    EXPECT_EQ(back.flags, r.flags);
    EXPECT_EQ(back.used_bindings, r.used_bindings);
    EXPECT_EQ(back.spirv_version, r.spirv_version);
    EXPECT_EQ(back.instruction_count, r.instruction_count);
    EXPECT_EQ(back.groups[1].handle[7], r.groups[1].handle[7]);
    EXPECT_EQ(back.groups[1].name, r.groups[1].name);
    EXPECT_EQ(back.spec_constants[0].default_value, r.spec_constants[0].default_value);
    EXPECT_EQ(back.trace_sites[1].variables, r.trace_sites[1].variables);
    EXPECT_EQ(back.trace_sites[1].callable, true);
    EXPECT_EQ(back.resources[1].array_size, 7u);
    EXPECT_EQ(back.stages[1].kind, rtc::StageKind::Callable);
    EXPECT_EQ(back.required_features, r.required_features);
    EXPECT_EQ(back.callable_words, 15u);
    EXPECT_EQ(back.attribute_words, 14u);
    EXPECT_EQ(back.payload_words, 13u);
    EXPECT_EQ(back.scratch_words, 12u);
    EXPECT_EQ(back.stack_words, 11u);
    EXPECT_EQ(back.push_constant_bytes, 64u);
}

TEST(Json, KeepsAnOrderAReaderCanDiff) {
    const std::string json = rtc::reflection_to_json(sample_reflection());
    EXPECT_LT(json.find("\"abiVersion\""), json.find("\"stages\""));
    EXPECT_LT(json.find("\"stages\""), json.find("\"traceSites\""));
    EXPECT_EQ(json.back(), '\n');
}

// The writer prints what the library would of the same values, in both forms.
TEST(Json, IsWrittenAsTheLibraryWritesIt) {
    rtc::Reflection r = sample_reflection();
    r.stages[0].name = "quotes \" backslash \\ newline \n, \xc3\xa4 and no UTF-8: \xff";
    r.resources.clear();
    const std::string pretty = rtc::reflection_to_json(r), line = rtc::embedded_json(r);
    EXPECT_EQ(nlohmann::ordered_json::parse(pretty).dump(2) + "\n", pretty);
    EXPECT_EQ(nlohmann::ordered_json::parse(line).dump(), line);
    EXPECT_THAT(line, HasSubstr("\\n, \xc3\xa4 and no UTF-8: \xef\xbf\xbd"));
}

TEST(Json, NamesTheReservedBindings) {
    const auto json = nlohmann::json::parse(rtc::reflection_to_json(sample_reflection()));
    ASSERT_EQ(json["reserved"]["bindings"].size(), 2u);
    EXPECT_EQ(json["reserved"]["bindings"][1]["name"], "scratch");
    EXPECT_EQ(json["reserved"]["bindings"][1]["binding"], 10 + RTC_BINDING_SCRATCH);
}

TEST(Json, EmbeddedTextNamesNoFolders) {
    const std::string json = rtc::embedded_json(sample_reflection());
    EXPECT_THAT(json, HasSubstr("\"a.rgen\""));
    EXPECT_THAT(json, HasSubstr("\"t.rcall\""));
    EXPECT_THAT(json, Not(HasSubstr("shaders")));
    EXPECT_THAT(json, Not(HasSubstr("\n")));
}

TEST(Json, BytesThatAreNoUtf8DoNotThrow) {
    rtc::Reflection r = sample_reflection();
    r.resources[0].name = "bad \xff\xfe name";
    EXPECT_TRUE(nlohmann::json::accept(rtc::reflection_to_json(r)));
}

TEST(Json, DamageIsAnError) {
    const std::string whole = rtc::reflection_to_json(sample_reflection());
    rtc::Reflection out;
    std::string error;
    for (size_t size = 0; size + 2 < whole.size(); size += 7)
        EXPECT_FALSE(rtc::reflection_from_json(whole.substr(0, size), out, error)) << size;
    EXPECT_FALSE(rtc::reflection_from_json("[]", out, error));
    EXPECT_FALSE(rtc::reflection_from_json("{\"abiVersion\": \"x\"}", out, error));
    std::string other = whole;
    other.replace(other.find("\"abiVersion\": 2"), 15, "\"abiVersion\": 7");
    EXPECT_FALSE(rtc::reflection_from_json(other, out, error));
    EXPECT_THAT(error, HasSubstr("ABI version 7"));
}

}  // namespace
