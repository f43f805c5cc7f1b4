// rtc-bench compile: what compiling costs. rtc's own passes against glslang's front end on the same stages, the whole
// with optimiser and validation, and, with --driver, the device driver's compile of the linked module.
#include <algorithm>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>

#include "commands.h"
#include "driver_compile.h"
#include "synthetic.h"

namespace rtc::bench {
namespace {

// Process time: on a shared machine the wall clock measures the neighbours.
double cpu_seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

// The least of several runs: noise only adds.
double least(int repeat, const std::function<void()>& work) {
    double best = 1e30;
    for (int i = 0; i < repeat; ++i) {
        const double begin = cpu_seconds();
        work();
        best = std::min(best, cpu_seconds() - begin);
    }
    return best;
}

struct Row {
    unsigned shaders = 0;
    double front_ms = 0, passes_ms = 0, total_ms = 0, driver_s = -1;
    uint32_t states = 0, instructions = 0;
};

[[noreturn]] void stop(const std::vector<Diagnostic>& diagnostics) {
    std::string text;
    for (const Diagnostic& d : diagnostics)
        if (d.severity == Severity::Error) text += d.file + ":" + std::to_string(d.line) + ": " + d.text + "\n";
    throw std::runtime_error(text.empty() ? "failed without a message" : text);
}

std::vector<std::vector<uint32_t>> front_end(const SyntheticPipeline& pipeline) {
    std::vector<std::vector<uint32_t>> modules;
    for (const GlslSource& source : pipeline.sources) {
        FrontendResult result = compile_glsl(source, {});
        if (!result.ok) stop(result.diagnostics);
        modules.push_back(std::move(result.spirv));
    }
    return modules;
}

Row measure(unsigned shaders, int repeat) {
    const SyntheticPipeline pipeline = synthetic_pipeline(shaders);
    Row row;
    row.shaders = shaders;
    std::vector<std::vector<uint32_t>> modules;
    row.front_ms = 1e3 * least(repeat, [&] { modules = front_end(pipeline); });

    const PipelineInput input = link_input(modules);
    LinkOptions plain;
    plain.max_recursion_depth = 2;
    plain.validate = false;
    plain.trust_input = true;  // the validator is in the total, not in the passes
    row.passes_ms = 1e3 * least(repeat, [&] {
                        LinkResult result = link_pipeline(input, plain);
                        if (!result.ok) stop(result.diagnostics);
                        row.states = result.reflection.state_count;
                        row.instructions = result.reflection.instruction_count;
                    });

    LinkOptions full = plain;
    full.optimize = Optimization::Performance;
    full.validate = true;
    full.trust_input = false;
    const double linked_ms = 1e3 * least(repeat, [&] {
                                 if (LinkResult result = link_pipeline(input, full); !result.ok) stop(result.diagnostics);
                             });
    row.total_ms = row.front_ms + linked_ms;
    return row;
}

std::vector<uint32_t> linked_module(unsigned shaders, bool optimize) {
    LinkOptions options;
    options.optimize = optimize ? Optimization::Performance : Optimization::None;
    options.max_recursion_depth = 2;
    LinkResult result = link_pipeline(link_input(front_end(synthetic_pipeline(shaders))), options);
    if (!result.ok) stop(result.diagnostics);
    return std::move(result.spirv);
}

void print(const std::vector<Row>& rows, const std::string& driver) {
    std::printf("| closest-hits | states | instructions | glslang ms | our passes ms | ratio | total with -O, validated ms "
                "| ratio |%s\n",
                driver.empty() ? "" : (" " + driver + " s |").c_str());
    std::printf("| --- | --- | --- | --- | --- | --- | --- | --- |%s\n", driver.empty() ? "" : " --- |");
    for (const Row& row : rows) {
        std::printf("| %u | %u | %u | %.1f | %.1f | %.2f | %.1f | %.2f |", row.shaders, row.states, row.instructions,
                    row.front_ms, row.passes_ms, row.passes_ms / row.front_ms, row.total_ms,
                    row.total_ms / row.front_ms);
        if (!driver.empty()) std::printf(" %.2f |", row.driver_s);
        std::printf("\n");
    }
}

struct Options {
    std::vector<unsigned> shaders{1, 4, 16, 64, 256};
    int repeat = 3;
    bool driver = false, optimize = false;
    std::string device, json_file;
};

void run_compile(const Options& options) {
    std::vector<Row> rows;
    measure(1, 1);  // glslang sets its tables up once in a process
    for (unsigned count : options.shaders) rows.push_back(measure(count, options.repeat));
    std::string driver_name;
    if (options.driver) {
        DriverCompiler compiler(options.device);
        driver_name = compiler.name();
        for (Row& row : rows) row.driver_s = compiler.cpu_seconds(linked_module(row.shaders, options.optimize));
    }
    print(rows, driver_name);

    if (!options.json_file.empty()) {
        nlohmann::ordered_json out{{"driver", driver_name}, {"rows", nlohmann::json::array()}};
        for (const Row& row : rows)
            out["rows"].push_back({{"shaders", row.shaders}, {"states", row.states}, {"instructions", row.instructions},
                                   {"front_end_ms", row.front_ms}, {"passes_ms", row.passes_ms},
                                   {"total_ms", row.total_ms}, {"driver_s", row.driver_s}});
        std::ofstream file(options.json_file);
        if (!(file << out.dump(2) << "\n")) throw std::runtime_error("cannot write " + options.json_file);
    }
}

}  // namespace

void add_compile_command(CLI::App& app) {
    CLI::App& compile = *app.add_subcommand(
        "compile", "Compile time of synthetic pipelines whose closest-hit shaders trace once each");
    auto options = std::make_shared<Options>();
    compile.add_option("--shaders", options->shaders, "Numbers of closest-hit shaders")
        ->delimiter(',')
        ->capture_default_str();
    compile.add_option("--repeat", options->repeat, "Runs of each; the least counts")
        ->check(CLI::PositiveNumber)
        ->capture_default_str();
    compile.add_flag("--driver", options->driver,
                     "Also measure the Vulkan driver's compile: pipeline creation and first launch");
    compile.add_flag("-O,--optimize", options->optimize, "Give --driver the module that -O makes");
    compile.add_option("--device", options->device, "Index or part of the name of the device for --driver");
    compile.add_option("--json", options->json_file, "Write the figures to this file too");
    compile.callback([options] { run_compile(*options); });
}

}  // namespace rtc::bench
