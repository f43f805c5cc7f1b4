// Writes the fuzzer's seed corpus: one file a golden stage, its kind in the first byte (see fuzz_link.cpp).
#include <cstdio>
#include <fstream>

#include "golden_case.h"

int main(int argc, char** argv) {
    if (argc != 2) {
        std::fprintf(stderr, "usage: %s FOLDER\n", argv[0]);
        return 2;
    }
    const std::filesystem::path out = argv[1];
    std::filesystem::create_directories(out);
    for (const auto& folder : rtc::test::golden_folders(RTC_GOLDEN_DIR)) {
        const rtc::test::GoldenCase golden = rtc::test::read_golden_case(folder);
        for (const rtc::StageInput& stage : golden.input.stages) {
            std::ofstream file(out / (golden.name + "-" + stage.name), std::ios::binary);
            file.put(static_cast<char>(static_cast<int>(stage.kind) + 6 * 3));
            file.write(reinterpret_cast<const char*>(stage.spirv.data()),
                       static_cast<std::streamsize>(stage.spirv.size() * 4));
        }
    }
    return 0;
}
