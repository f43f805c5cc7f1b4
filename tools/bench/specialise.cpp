// rtc-bench specialise: what each promise about a scene gains, alone and together, against the same pipeline with
// nothing removed. Launches are interleaved; a CPU's time is the process's, a GPU's its own clock.
#include <algorithm>
#include <cctype>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>

#include "bench_device.h"
#include "bench_scenes.h"
#include "commands.h"
#include "error.h"
#include "pipeline.h"
#include "pipeline_statistics.h"
#include "trace_runner.h"
#include "vulkan_context.h"

namespace rtc::bench {
namespace {

using tools::Context;
using tools::ContextOptions;
using tools::Error;
using tools::RtcDevice;
using tools::RtcScene;

struct Options {
    std::vector<std::string> scenes{"cornell", "terrain", "spheres", "instances"};
    std::string workload = "path", device, update_file, json_file;
    uint32_t size = 0;  // 0: by the kind of device
    int repeats = 9;
    double scale = 1;
};

double cpu_seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

// One column: which switches are on.
struct Switches {
    std::string name;
    std::vector<std::string> assume;
    bool specialize = true;
};

struct Cell {
    bool applies = true;  // the scene meets the assumptions
    double gain = 0;      // time with nothing removed over this time
    double compile_s = 0;
    uint32_t instructions = 0;
    uint32_t registers = 0;  // of all passes, the most; 0: the driver does not tell
};

// The largest number behind a name with "register count" in it, in what TraceRunner::statistics says.
uint32_t registers_in(std::string statistics) {
    std::transform(statistics.begin(), statistics.end(), statistics.begin(), [](unsigned char c) { return char(std::tolower(c)); });
    const std::string name = "register count ";
    uint32_t most = 0;
    for (size_t at = statistics.find(name); at != std::string::npos; at = statistics.find(name, at + 1))
        most = std::max(most, uint32_t(std::strtoul(statistics.c_str() + at + name.size(), nullptr, 10)));
    return most;
}

struct Running {
    size_t column = 0;
    std::unique_ptr<TraceRunner> runner;
    std::vector<double> times;
};

class Bench {
  public:
    explicit Bench(const Options& options) : options_(options), modules_("") {
        // A shader that the driver finds on disk costs nothing to compile.
        setenv("MESA_SHADER_CACHE_DISABLE", "true", 1);
        setenv("__GL_SHADER_DISK_CACHE", "0", 1);
        ContextOptions context_options;
        context_options.device = options.device;
        tools::want_pipeline_statistics(context_options, statistics_);
        context_ = std::make_unique<Context>(context_options);
        device_ = std::make_unique<RtcDevice>(*context_);
        timer_ = std::make_unique<tools::GpuTimer>(*context_);
        cpu_ = context_->properties.deviceType == VK_PHYSICAL_DEVICE_TYPE_CPU;
        size_ = options.size ? options.size : cpu_ ? 128 : 2048;
        columns_.push_back({"nothing removed", {}, false});
        columns_.push_back({"nothing more", {}, true});
        for (const Assumption& known : assumptions()) columns_.push_back({known.name, {known.name}, true});
        columns_.push_back({"all", {}, true});
    }

    void run() {
        for (const std::string& name : options_.scenes) run_scene(name);
        const std::string text = table();
        std::fputs(text.c_str(), stdout);
        if (!options_.update_file.empty()) update(text);
        if (!options_.json_file.empty()) write_json();
    }

  private:
    double launch(TraceRunner& runner, uint32_t sample) {
        const double begin = cpu_seconds();
        context_->run([&](VkCommandBuffer commands) {
            timer_->reset(commands);
            timer_->begin(commands);
            runner.record(commands, sample);
            timer_->end(commands);
        });
        const double end = cpu_seconds();
        runner.finish();
        return cpu_ ? end - begin : timer_->seconds();
    }

    // Compiles and launches; false when the scene is not what the column assumes.
    bool start(const tools::Scene& scene, const std::shared_ptr<RtcScene>& structures, Running& running, Cell& cell) {
        const Switches& switches = columns_[running.column];
        TraceVariant variant;
        variant.name = switches.name;
        variant.specialize = switches.specialize;
        for (const std::string& name : switches.assume) variant.assume += (variant.assume.empty() ? "" : ",") + name;
        try {
            const Workload workload = make_workload(options_.workload, size_, size_);
            const double begin = cpu_seconds();
            running.runner = make_rtc_runner(*device_, scene, structures, workload, variant, modules_);
            launch(*running.runner, 0);
            const double first = cpu_seconds();
            launch(*running.runner, 1);
            cell.compile_s = std::max(0.0, (first - begin) - (cpu_seconds() - first));
            cell.registers = registers_in(running.runner->statistics);
            cell.instructions = instructions(running.runner->job(), variant);
            return true;
        } catch (const Error& error) {
            if (switches.assume.empty()) throw;
            running.runner.reset();
            cell.applies = false;
            return false;
        }
    }

    uint32_t instructions(const tools::RenderJob& job, const TraceVariant& variant) {
        uint32_t count = 0;
        for (const tools::RayTracingJob& pass : job.passes) {
            std::string json;
            if (extract_reflection_json(modules_.get(options_.workload, pass, variant, *device_), json))
                count += nlohmann::json::parse(json).at("instructions").get<uint32_t>();
        }
        return count;
    }

    void run_scene(const std::string& name) {
        std::fprintf(stderr, "rtc-bench: %s\n", name.c_str());
        const tools::Scene scene = bench_scene(name, options_.scale);
        const auto structures = std::make_shared<RtcScene>(*device_, scene, false, by_address({}, *device_));
        std::vector<Cell> cells(columns_.size());
        std::vector<Running> running;
        columns_.back().assume.clear();
        for (size_t i = 0; i < columns_.size(); ++i) {
            Running one;
            one.column = i;
            if (!start(scene, structures, one, cells[i])) continue;
            if (columns_[i].assume.size() == 1) columns_.back().assume.push_back(columns_[i].assume.front());
            running.push_back(std::move(one));
        }
        for (int repeat = 0; repeat < options_.repeats; ++repeat)
            for (Running& one : running) one.times.push_back(launch(*one.runner, 1));
        for (const Running& one : running) {
            std::vector<double> ratios;
            for (size_t i = 0; i < one.times.size(); ++i) ratios.push_back(running.front().times[i] / one.times[i]);
            cells[one.column].gain = median_of(ratios);
        }
        rows_.push_back({name, std::move(cells)});
    }

    std::string table() const {
        std::ostringstream out;
        char text[64];
        out << "`" << options_.workload << "`, " << size_ << "×" << size_
            << ": time with nothing removed over time with what is proven and this switch alone (median of " << options_.repeats
            << " interleaved " << (cpu_ ? "CPU-time" : "GPU-clock")
            << " ratios; above 1 is faster; –: the scene is not so).\n\n| proof and |";
        for (const auto& [name, cells] : rows_) out << " " << name << " |";
        bool told = false;
        for (const auto& [name, cells] : rows_)
            for (const Cell& cell : cells) told = told || cell.registers;
        out << " instructions |" << (told ? " registers |" : "") << " driver's compile, s |\n| --- |";
        for (size_t i = 0; i < rows_.size() + 2 + told; ++i) out << " --- |";
        out << "\n";
        for (size_t column = 0; column < columns_.size(); ++column) {
            out << "| " << columns_[column].name << " |";
            uint32_t instructions = 0, registers = 0;
            std::vector<double> compile;
            for (const auto& [name, cells] : rows_) {
                const Cell& cell = cells[column];
                if (cell.applies) {
                    std::snprintf(text, sizeof text, " %.3f |", cell.gain);
                    instructions = instructions ? std::min(instructions, cell.instructions) : cell.instructions;
                    registers = std::max(registers, cell.registers);
                    compile.push_back(cell.compile_s);
                } else {
                    std::snprintf(text, sizeof text, " – |");
                }
                out << text;
            }
            if (!instructions) {
                out << (told ? " – | – | – |\n" : " – | – |\n");
                continue;
            }
            out << " " << instructions << " |";
            if (told) out << " " << registers << " |";
            std::snprintf(text, sizeof text, " %.2f |\n", median_of(compile));
            out << text;
        }
        return out.str();
    }

    // Replaces what stands between this device's marks, or adds it at the end.
    void update(const std::string& text) const {
        const std::string key = std::string(context_->driver.driverName) + " " + context_->driver.driverInfo;
        const std::string begin = "<!-- rtc-bench specialise: " + key + " -->\n", end = "<!-- end -->\n";
        std::ifstream in(options_.update_file);
        std::stringstream read;
        read << in.rdbuf();
        std::string whole = read.str();
        char date[32];
        const std::time_t now = std::time(nullptr);
        std::strftime(date, sizeof date, "%d %B %Y", std::gmtime(&now));
        const std::string part = begin + "### " + tools::describe_device(context_->properties, context_->driver) + ", " +
                                 date + "\n" + text + end;
        const size_t at = whole.find(begin);
        const size_t stop = at == std::string::npos ? at : whole.find(end, at);
        if (stop == std::string::npos)
            whole += "\n" + part;
        else
            whole.replace(at, stop + end.size() - at, part);
        std::ofstream out(options_.update_file);
        if (!(out << whole)) throw Error("cannot write " + options_.update_file);
    }

    void write_json() const {
        nlohmann::ordered_json out{{"device", tools::describe_device(context_->properties, context_->driver)},
                                   {"workload", options_.workload},
                                   {"size", size_},
                                   {"repeats", options_.repeats},
                                   {"scenes", nlohmann::json::array()}};
        for (const auto& [name, cells] : rows_) {
            nlohmann::ordered_json scene{{"name", name}, {"switches", nlohmann::json::array()}};
            for (size_t i = 0; i < cells.size(); ++i)
                scene["switches"].push_back({{"name", columns_[i].name},
                                             {"applies", cells[i].applies},
                                             {"gain", cells[i].gain},
                                             {"instructions", cells[i].instructions},
                                             {"registers", cells[i].registers},
                                             {"driver_compile_s", cells[i].compile_s}});
            out["scenes"].push_back(std::move(scene));
        }
        std::ofstream file(options_.json_file);
        if (!(file << out.dump(1) << "\n")) throw Error("cannot write " + options_.json_file);
    }

    const Options options_;
    ModuleCache modules_;
    std::unique_ptr<Context> context_;
    std::unique_ptr<RtcDevice> device_;
    std::unique_ptr<tools::GpuTimer> timer_;
    VkPhysicalDevicePipelineExecutablePropertiesFeaturesKHR statistics_{};
    bool cpu_ = false;
    uint32_t size_ = 0;
    std::vector<Switches> columns_;
    std::vector<std::pair<std::string, std::vector<Cell>>> rows_;
};

}  // namespace

void add_specialise_command(CLI::App& app) {
    CLI::App& command = *app.add_subcommand(
        "specialise", "What each promise about a scene (rtc --assume) gains, alone and together");
    auto options = std::make_shared<Options>();
    command.add_option("--scenes", options->scenes, "as of rtc-bench trace")->delimiter(',')->capture_default_str();
    command.add_option("--workload", options->workload, "of primary, ao, path, recursive")->capture_default_str();
    command.add_option("--size", options->size, "pixels on a side; default 2048 on GPUs, 128 on CPUs");
    command.add_option("--repeats", options->repeats, "timings of each, interleaved; the median ratio counts")
        ->check(CLI::PositiveNumber)
        ->capture_default_str();
    command.add_option("--scale", options->scale, "factor on the triangles of the scenes made here")
        ->check(CLI::PositiveNumber)
        ->capture_default_str();
    command.add_option("--device", options->device, "index or part of the name; default: $RTC_DEVICE, else the best");
    command.add_option("--update", options->update_file, "put the table into this Markdown file, in this device's place");
    command.add_option("--json", options->json_file, "write the figures to this file");
    command.callback([options] { Bench(*options).run(); });
}

}  // namespace rtc::bench
