// "Thread-safe across objects": compilers, pipelines and options used at once give
// the bytes they give alone, and const objects may be shared.
#include "api_util.h"

#include <thread>
#include <vector>

namespace {

constexpr int kThreads = 6;

TEST(Concurrency, SeparateObjectsGiveTheSameBytes) {
    const std::string expected = bytes_of(compile(small_pipeline()));
    ASSERT_FALSE(expected.empty());
    std::vector<std::string> made(kThreads);
    std::vector<std::thread> threads;
    for (int i = 0; i < kThreads; ++i)
        threads.emplace_back(
            [&made, i] { made[static_cast<size_t>(i)] = bytes_of(compile(small_pipeline())); });
    for (std::thread& thread : threads) thread.join();
    for (const std::string& bytes : made) EXPECT_EQ(bytes, expected);
}

TEST(Concurrency, OneSetOfObjectsServesManyCompilations) {
    Compiler compiler(rtcc_compiler_create());
    Options options(rtcc_options_create());
    rtcc_options_set_optimization(options.get(), RTCC_OPTIMIZATION_SIZE);
    const Pipeline pipeline = small_pipeline();
    const std::string expected = bytes_of(compile(pipeline, options.get()));
    std::vector<std::string> made(kThreads);
    std::vector<std::thread> threads;
    for (int i = 0; i < kThreads; ++i)
        threads.emplace_back([&, i] {
            made[static_cast<size_t>(i)] =
                bytes_of(Result(rtcc_compile_pipeline(compiler.get(), pipeline.get(), options.get())));
        });
    for (std::thread& thread : threads) thread.join();
    for (const std::string& bytes : made) EXPECT_EQ(bytes, expected);
}

TEST(Concurrency, DifferentSourcesDoNotMeet) {
    std::vector<std::thread> threads;
    std::vector<int> good(kThreads, 0);
    for (int i = 0; i < kThreads; ++i)
        threads.emplace_back([&good, i] {
            const std::string file = "t" + std::to_string(i) + ".rmiss";
            const std::string source = "#version 460\n#extension GL_NV_ray_tracing : require\n" +
                                       std::string(static_cast<size_t>(i), '\n') + "void main() { wrong" +
                                       std::to_string(i) + "(); }\n";
            for (int round = 0; round < 4; ++round) {
                const Result result = compile_stage(source, file.c_str());
                const rtcc_diagnostic message = rtcc_result_diagnostic(result.get(), 0);
                const bool own =
                    message.file == file && message.line == static_cast<uint32_t>(i) + 3 &&
                    std::string(message.text).find("wrong" + std::to_string(i)) != std::string::npos;
                good[static_cast<size_t>(i)] += own;
            }
        });
    for (std::thread& thread : threads) thread.join();
    for (int count : good) EXPECT_EQ(count, 4);
}

}  // namespace
