// rtc-bench trace: rtc beside the device's own ray tracing on the same scenes with the same shaders, their launches
// interleaved in one run.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <map>
#include <memory>

#include "bench_device.h"
#include "bench_scenes.h"
#include "commands.h"
#include "error.h"
#include "pipeline_statistics.h"
#include "trace_report.h"
#include "trace_runner.h"

namespace rtc::bench {
namespace {

using tools::Context;
using tools::Error;
using tools::RtcDevice;
using tools::RtcScene;
using Clock = std::chrono::steady_clock;
using Kind = native::Requirements::Kind;

// By build preference and addressing.
using SceneVariants = std::map<std::pair<bool, bool>, std::shared_ptr<RtcScene>>;

struct Options {
    std::vector<std::string> scenes{"cornell", "terrain", "spheres", "blob", "soup", "strands", "instances"};
    std::vector<std::string> workloads{"primary", "ao", "path"};
    std::vector<std::string> variants, native{"auto"};
    std::string device, json_file, markdown_file, save_modules;
    uint32_t width = 0, height = 0;  // 0: by the kind of device
    int repeats = 9;
    double scale = 1, native_limit = 8, warm_up = 0.15;
    bool validate = false, statistics = false;
};

double seconds_since(Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
}

class Bench {
  public:
    explicit Bench(const Options& options)
        : options_(options),
          modules_(options.save_modules),
          bench_device_(options.device, options.native, options.validate, options.statistics),
          context_(*bench_device_.context),
          device_(*bench_device_.rtc) {
        report_.device = bench_device_.description;
        report_.width = options.width ? options.width : bench_device_.is_cpu() ? 256 : 2048;
        report_.height = options.height ? options.height : report_.width;
        for (const std::string& text : options.variants) variants_.push_back(parse_variant(text));
        if (variants_.empty()) variants_.push_back(parse_variant(""));
    }

    // True when rtc did everything that was asked of it.
    bool run() {
        for (const std::string& name : options_.scenes) run_scene(name);
        std::printf("\n%s\n%s", heading("Geometric means").c_str(), summary_table(report_).c_str());
        write_files();
        context_.require_silent_validation();
        return std::none_of(report_.rows.begin(), report_.rows.end(),
                            [](const TraceRow& row) { return !row.native && row.times.empty(); });
    }

  private:
    static std::string heading(const std::string& text) { return "### " + text + "\n"; }

    void run_scene(const std::string& name) {
        const tools::Scene scene = bench_scene(name, options_.scale);
        SceneVariants structures;
        for (const TraceVariant& variant : variants_)
            if (std::shared_ptr<RtcScene>& built = structures[{variant.fast_build, by_address(variant, device_)}]; !built)
                built = std::make_shared<RtcScene>(device_, scene, variant.fast_build, by_address(variant, device_));
        for (const std::string& workload : options_.workloads)
            run_workload(name, scene, structures, make_workload(workload, report_.width, report_.height));
        std::string title = name + ": " + std::to_string(scene.triangle_count()) + " triangles";
        if (scene.instances.size() > 1) title += ", " + std::to_string(scene.instances.size()) + " instances";
        scene_texts_.push_back(heading(title) + scene_table(report_, name));
        std::printf("\n%s", scene_texts_.back().c_str());
        std::fflush(stdout);
    }

    struct Entry {
        std::unique_ptr<TraceRunner> runner;
        size_t row = 0;  // in the report
        uint32_t batch = 1;
        double estimate = 0;  // seconds a launch
    };

    void run_workload(const std::string& scene_name, const tools::Scene& scene,
                      const SceneVariants& structures, const Workload& workload) {
        std::vector<Entry> entries;
        auto add = [&](const std::string& runner_name, bool is_native, const auto& make) {
            TraceRow row;
            row.scene = scene_name;
            row.workload = workload.name;
            row.runner = runner_name;
            row.native = is_native;
            row.width = report_.width;
            row.height = report_.height;
            Entry entry;
            entry.row = report_.rows.size();
            report_.rows.push_back(row);
            try {
                entry.runner = make();
                prepare(entry, is_native);
                if (report_.rows[entry.row].times.empty()) entries.push_back(std::move(entry));
            } catch (const std::exception& problem) {
                report_.rows[entry.row].error = problem.what();
                std::fprintf(stderr, "rtc-bench: %s, %s, %s: %s\n", scene_name.c_str(), workload.name.c_str(),
                             runner_name.c_str(), problem.what());
            }
        };
        reference_.reset();
        for (Kind kind : bench_device_.kinds)
            add(kind == Kind::Khr ? "native KHR" : "native NV", true,
                [&] { return make_native_runner(context_, scene, workload, kind); });
        for (const TraceVariant& variant : variants_)
            add(variant.name, false, [&] {
                auto runner = make_rtc_runner(device_, scene,
                                              structures.at({variant.fast_build, by_address(variant, device_)}),
                                              workload, variant, modules_);
                if (!runner->statistics.empty())
                    std::printf("%s, %s: %s\n", workload.name.c_str(), variant.name.c_str(), runner->statistics.c_str());
                return runner;
            });
        measure(entries);
    }

    // The first launch, which compiles; the picture; how long a launch takes. A native runner that would take
    // longer than the limit gets its times here, at a smaller size.
    void prepare(Entry& entry, bool is_native) {
        TraceRow& row = report_.rows[entry.row];
        if (is_native && too_slow(entry, row)) return;
        clear(entry.runner->job());
        launch(*entry.runner, 1, 0);
        tools::RenderResult result = result_of(context_, entry.runner->job(), 1);
        const bool counts = result.rays > 0;  // "primary" writes no colour and no count
        row.rays = counts ? result.rays : double(row.width) * row.height;
        if (!reference_) {
            reference_ = std::make_unique<tools::RenderResult>(std::move(result));
        } else {
            const tools::Comparison comparison = tools::compare(*reference_, result);
            if (counts) row.pixels_within = double(comparison.within) / double(comparison.pixels);
            if (row.workload == "primary" || row.workload == "path")
                row.first_hits_equal = 1.0 - double(comparison.first_hits_differ) / double(comparison.pixels);
        }
        entry.estimate = launch(*entry.runner, 1, 0);
        const uint32_t most = std::min(16u, entry.runner->max_batch());
        entry.batch = std::clamp(uint32_t(0.003 / std::max(entry.estimate, 1e-6)), 1u, most);
    }

    bool too_slow(Entry& entry, TraceRow& row) {
        for (uint32_t size = 16; size < std::min(row.width, row.height); size *= 2) {
            entry.runner->set_size(size, size);
            clear(entry.runner->job());
            const double first = launch(*entry.runner, 1, 0);
            const double counted = entry.runner->job().rays(context_);
            const double time = first * 4 > options_.native_limit ? first : launch(*entry.runner, 1, 0);
            if (time * 4 <= options_.native_limit) continue;
            row.rays = counted > 0 ? counted : double(size) * size;
            row.times = {time};
            row.width = row.height = size;
            row.reduced = true;
            return true;
        }
        entry.runner->set_size(0, 0);
        return false;
    }

    void measure(std::vector<Entry>& entries) {
        const Clock::time_point start = Clock::now();
        // A GPU's clock rises under load only.
        while (!entries.empty() && seconds_since(start) < options_.warm_up)
            for (Entry& entry : entries) launch(*entry.runner, entry.batch, 1);
        for (int repeat = 0; repeat < options_.repeats; ++repeat)
            for (Entry& entry : entries)
                report_.rows[entry.row].times.push_back(launch(*entry.runner, entry.batch, 0));
    }

    // Seconds of one launch.
    double launch(TraceRunner& runner, uint32_t batch, uint32_t sample) {
        const double seconds = bench_device_.time([&](VkCommandBuffer commands) {
            for (uint32_t i = 0; i < batch; ++i) runner.record(commands, sample);
        });
        runner.finish();
        return seconds / batch;
    }

    void clear(const tools::RenderJob& job) {
        context_.run([&](VkCommandBuffer commands) {
            const VkClearColorValue zero{};
            const VkImageSubresourceRange whole{VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1};
            for (const tools::Image* image : {&job.accumulation, &job.gbuffer})
                vkCmdClearColorImage(commands, image->handle, VK_IMAGE_LAYOUT_GENERAL, &zero, 1, &whole);
            tools::full_barrier(commands);
        });
    }

    void write_files() const {
        if (!options_.json_file.empty()) {
            std::ofstream file(options_.json_file);
            if (!(file << as_json(report_).dump(1) << "\n")) throw Error("cannot write " + options_.json_file);
        }
        if (options_.markdown_file.empty()) return;
        std::ofstream file(options_.markdown_file);
        file << report_.device << ", " << report_.width << "×" << report_.height << ", median of "
             << options_.repeats << " interleaved.\n\n"
             << heading("Geometric means") << summary_table(report_);
        for (const std::string& text : scene_texts_) file << "\n" << text;
        if (!file) throw Error("cannot write " + options_.markdown_file);
    }

    const Options options_;
    ModuleCache modules_;
    BenchDevice bench_device_;
    const Context& context_;
    const RtcDevice& device_;
    std::vector<TraceVariant> variants_;
    TraceReport report_;
    std::vector<std::string> scene_texts_;
    std::unique_ptr<tools::RenderResult> reference_;
};

}  // namespace

void add_trace_command(CLI::App& app) {
    CLI::App& trace = *app.add_subcommand(
        "trace", "Rays a second on several scenes, beside the device's own ray tracing where it has one");
    auto options = std::make_shared<Options>();
    trace.add_option("--scenes", options->scenes,
                     "of rtc-render's built-in scenes, blob, soup, strands, instances, or files")
        ->delimiter(',')
        ->capture_default_str();
    trace.add_option("--workloads", options->workloads, "of primary, ao, path, recursive")
        ->delimiter(',')
        ->capture_default_str();
    trace.add_option("--variant", options->variants, variant_help())->allow_extra_args(false);
    trace.add_option("--native", options->native, "of nv, khr; or auto, none")
        ->delimiter(',')
        ->check(CLI::IsMember({"nv", "khr", "auto", "none"}))
        ->capture_default_str();
    trace.add_option("--width", options->width, "pixels; default 2048 on GPUs, 256 on CPUs");
    trace.add_option("--height", options->height, "pixels; default: the width");
    trace.add_option("--repeats", options->repeats, "timings of each, interleaved; the median counts")
        ->check(CLI::PositiveNumber)
        ->capture_default_str();
    trace.add_option("--scale", options->scale, "factor on the triangles of the scenes made here")
        ->check(CLI::PositiveNumber)
        ->capture_default_str();
    trace.add_option("--warm-up", options->warm_up, "seconds of launches before timing")->capture_default_str();
    trace.add_option("--native-limit", options->native_limit,
                     "seconds a native launch may take; a slower one is measured on a smaller picture")
        ->check(CLI::PositiveNumber)
        ->capture_default_str();
    trace.add_option("--save-modules", options->save_modules, "folder to keep the compiled modules in");
    trace.add_option("--device", options->device, "index or part of the name; default: $RTC_DEVICE, else the best");
    trace.add_flag("--statistics", options->statistics, "print what the driver tells of rtc's pipelines: registers, spills");
    trace.add_flag("--validate", options->validate, "Vulkan validation; any message is an error");
    trace.add_option("--json", options->json_file, "write every timing to this file");
    trace.add_option("--markdown", options->markdown_file, "write the tables to this file");
    trace.callback([options] {
        if (!Bench(*options).run()) throw Error("not everything ran; see above");
    });
}

}  // namespace rtc::bench
