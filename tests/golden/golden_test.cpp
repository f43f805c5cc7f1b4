// Links every golden set and compares the text with what is checked in.
// `rtc_golden_test --update FOLDER` writes the text instead (see tools/update-golden).
#include <gtest/gtest.h>

#include <cstdio>
#include <cstring>
#include <fstream>
#include <thread>

#include "golden_case.h"
#include "link/link.h"

namespace rtc::test {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> split_lines(const std::string& text) {
    std::vector<std::string> lines;
    size_t begin = 0;
    while (begin < text.size()) {
        size_t end = text.find('\n', begin);
        if (end == std::string::npos) end = text.size();
        lines.push_back(text.substr(begin, end - begin));
        begin = end + 1;
    }
    return lines;
}

// A diff of whole lines between the first and the last difference; enough to see what moved.
std::string difference(const std::string& expected, const std::string& actual) {
    const auto a = split_lines(expected), b = split_lines(actual);
    size_t head = 0, tail = 0;
    while (head < a.size() && head < b.size() && a[head] == b[head]) ++head;
    while (tail < a.size() - head && tail < b.size() - head && a[a.size() - 1 - tail] == b[b.size() - 1 - tail])
        ++tail;
    constexpr size_t kShown = 60;
    std::string out = "from line " + std::to_string(head + 1) + ":\n";
    const auto show = [&](const std::vector<std::string>& lines, char sign) {
        const size_t end = lines.size() - tail;
        for (size_t i = head; i < end && i < head + kShown; ++i) out += sign + lines[i] + "\n";
        if (end > head + kShown) out += "  ... " + std::to_string(end - head - kShown) + " more lines\n";
    };
    show(a, '-');
    show(b, '+');
    return out;
}

std::string errors(const LinkResult& result) {
    std::string text;
    for (const Diagnostic& d : result.diagnostics)
        if (d.severity == Severity::Error) text += d.id + ": " + d.text + "\n";
    return text;
}

class Golden : public testing::TestWithParam<fs::path> {};

TEST_P(Golden, TextIsAsExpected) {
    const GoldenCase golden = read_golden_case(GetParam());
    const LinkResult result = link_pipeline(golden.input, golden.options);
    ASSERT_TRUE(result.ok) << errors(result);
    const std::string actual = golden_text(result, golden.whole_module());
    const std::string expected = read_text(GetParam() / "expected.txt");
    EXPECT_TRUE(actual == expected) << difference(expected, actual) << "If this is what you meant: tools/update-golden "
                                    << golden.name;
}

// Every set, whatever its dump, also makes a complete module, and the same one on another thread.
TEST_P(Golden, LinksToTheSameValidModuleOnEveryThread) {
    GoldenCase golden = read_golden_case(GetParam());
    golden.options.stop_after.clear();
    golden.options.validate = true;
    const LinkResult first = link_pipeline(golden.input, golden.options);
    ASSERT_TRUE(first.ok) << errors(first);
    ASSERT_FALSE(first.spirv.empty());
    LinkResult second;
    std::thread([&] { second = link_pipeline(golden.input, golden.options); }).join();
    EXPECT_TRUE(first.spirv == second.spirv) << "linking is not deterministic";

    // The linker leaves traversal out of what it validates and optimises; here the whole module is looked at.
    const auto check = [](const LinkResult& result) {
        const uint32_t version = result.reflection.spirv_version;
        return link::validate(result.spirv, version >= 0x00010600u ? 3 : version >= 0x00010400u ? 2 : 1);
    };
    EXPECT_EQ(check(first), "");
    golden.options.optimize = Optimization::Performance;
    const LinkResult optimized = link_pipeline(golden.input, golden.options);
    ASSERT_TRUE(optimized.ok) << errors(optimized);
    EXPECT_EQ(check(optimized), "");
    golden.options.addressing = Addressing::Address;
    golden.options.resumable = false;
    const LinkResult addresses = link_pipeline(golden.input, golden.options);
    ASSERT_TRUE(addresses.ok) << errors(addresses);
    EXPECT_EQ(check(addresses), "");
}

// An edit of traversal may change the text of a few sets, not of most: all but three stop before it is linked.
TEST(GoldenSets, AllButThreeStopBeforeTraversalIsLinked) {
    const std::vector<fs::path> folders = golden_folders(RTC_GOLDEN_DIR);
    size_t whole = 0;
    for (const fs::path& folder : folders) {
        const std::string dump = read_golden_case(folder).options.stop_after;
        whole += dump != "split" && dump != "facts";
    }
    EXPECT_GE(folders.size(), 20u);
    EXPECT_LE(whole, 3u);
}

INSTANTIATE_TEST_SUITE_P(Sets, Golden, testing::ValuesIn(golden_folders(RTC_GOLDEN_DIR)),
                         [](const testing::TestParamInfo<fs::path>& info) {
                             std::string name = info.param.filename().string();
                             for (char& c : name)
                                 if (c == '-') c = '_';
                             return name;
                         });

int update(const fs::path& folder) {
    const GoldenCase golden = read_golden_case(folder);
    const LinkResult result = link_pipeline(golden.input, golden.options);
    const bool code = golden.options.stop_after != "facts";
    if (!result.ok || (code && result.dump.find("OpFunction") == std::string::npos)) {
        std::fprintf(stderr, "%s: not linked, expected.txt left alone\n%s", golden.name.c_str(),
                     (errors(result) + result.dump).substr(0, 1000).c_str());
        return 1;
    }
    std::ofstream(folder / "expected.txt", std::ios::binary) << golden_text(result, golden.whole_module());
    return 0;
}

}  // namespace
}  // namespace rtc::test

int main(int argc, char** argv) {
    try {
        if (argc == 3 && std::strcmp(argv[1], "--update") == 0) return rtc::test::update(argv[2]);
        testing::InitGoogleTest(&argc, argv);
        return RUN_ALL_TESTS();
    } catch (const rtc::test::GoldenError& error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 1;
    }
}
