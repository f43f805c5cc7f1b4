// rtc-bench build: building acceleration structures with rtc and with the device's own builders, interleaved.
#include <chrono>
#include <cstdio>
#include <fstream>
#include <glm/gtc/matrix_transform.hpp>

#include "bench_device.h"
#include "bench_scenes.h"
#include "build_report.h"
#include "build_subject.h"
#include "commands.h"
#include "error.h"

namespace rtc::bench {
namespace {

using tools::Error;
using Clock = std::chrono::steady_clock;
using Kind = native::Requirements::Kind;

struct Options {
    std::vector<size_t> sizes{1000, 3000, 10000, 30000, 100000, 300000, 1000000, 2000000, 4000000};
    std::vector<std::string> meshes{"blob"}, native{"auto"}, modes{"trace", "fast", "memory", "update"};
    uint32_t instances = 10000, batch = 0;
    size_t batch_triangles = 1000;
    int repeats = 9;
    double seconds = 6;  // of one row, once it has three timings
    std::string device, json_file, markdown_file, svg_file;
    bool validate = false;
};

tools::Mesh make_mesh(const std::string& name, size_t triangles) {
    if (name == "blob") return make_blob(triangles);
    if (name == "soup") return make_soup(triangles);
    if (name == "strands") return make_strands(triangles);
    throw Error("no mesh '" + name + "'; there are: blob soup strands");
}

// Copies in a cube, turned this way and that.
std::vector<glm::mat4> make_instances(uint32_t count) {
    std::vector<glm::mat4> instances;
    uint32_t state = 5;
    auto random = [&] {
        state = state * 747796405u + 2891336453u;
        uint32_t word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
        return float(((word >> 22u) ^ word) >> 8) * (1.0f / 16777216.0f);
    };
    for (uint32_t i = 0; i < count; ++i) {
        const float x = random(), y = random(), z = random(), turn = random();
        const glm::mat4 place = glm::translate(glm::mat4(1), glm::vec3(x, y, z) * 100.0f);
        instances.push_back(glm::rotate(place, turn * 6.28f, glm::normalize(glm::vec3(y + 0.1f, z, x))));
    }
    return instances;
}

class Bench {
  public:
    explicit Bench(const Options& options)
        : options_(options), device_(options.device, options.native, options.validate) {
        report_.device = device_.description;
    }

    void run() {
        for (const std::string& mesh : options_.meshes)
            for (size_t size : options_.sizes) {
                BuildInput input;
                input.mesh = make_mesh(mesh, size);
                run_modes(mesh, input);
            }
        if (options_.instances) {
            BuildInput input;
            input.mesh = make_blob(1000);
            input.instances = make_instances(options_.instances);
            run_modes("instances", input);
        }
        if (options_.batch) {
            BuildInput input;
            input.mesh = make_blob(options_.batch_triangles);
            input.copies = options_.batch;
            for (bool together : {false, true}) {
                input.together = together;
                run_row(std::to_string(options_.batch) + " blobs", together ? "in one call" : "one by one", input);
            }
        }
        std::printf("%s", build_table(report_).c_str());
        write_files();
        device_.context->require_silent_validation();
    }

    bool failed() const {
        for (const BuildRow& row : report_.rows)
            if (row.by == "rtc" && row.times.empty()) return true;
        return false;
    }

  private:
    void run_modes(const std::string& mesh, BuildInput input) {
        for (const std::string& mode : options_.modes) {
            input.fast_build = mode == "fast";
            input.low_memory = mode == "memory";
            input.allow_update = mode == "update";
            run_row(mesh, mode == "fast"     ? "fast build"
                          : mode == "memory" ? "low memory"
                          : mode == "update" ? "update"
                                             : "fast trace",
                    input);
        }
    }

    struct Entry {
        std::unique_ptr<BuildSubject> subject;
        size_t row;
    };

    void run_row(const std::string& mesh, const char* mode, const BuildInput& input) {
        std::vector<Entry> entries;
        auto add = [&](const char* by, const auto& make) {
            BuildRow row;
            row.mesh = mesh;
            row.mode = mode;
            row.by = by;
            row.top = !input.instances.empty();
            row.primitives = row.top ? input.instances.size() : input.mesh.triangle_count() * input.copies;
            report_.rows.push_back(row);
            try {
                Entry entry{make(), report_.rows.size() - 1};
                time(*entry.subject, false);
                BuildRow& made = report_.rows.back();
                made.bytes = double(entry.subject->bytes) * input.copies;
                made.scratch = double(input.allow_update ? entry.subject->update_scratch_bytes
                                                         : entry.subject->scratch_bytes) *
                               input.copies;
                made.compacted = double(entry.subject->compacted_bytes()) * input.copies;
                entries.push_back(std::move(entry));
            } catch (const std::exception& problem) {
                report_.rows.back().error = problem.what();
                std::fprintf(stderr, "rtc-bench: %s, %s, %s: %s\n", mesh.c_str(), mode, by, problem.what());
            }
        };
        add("rtc", [&] { return make_rtc_subject(*device_.rtc, input); });
        for (Kind kind : device_.kinds)
            add(kind == Kind::Khr ? "native KHR" : "native NV", [&] {
                if (kind != Kind::Khr && input.copies > 1) throw Error("builds of one call are KHR's");
                return kind == Kind::Khr ? make_khr_subject(*device_.context, input)
                                         : make_nv_subject(*device_.context, input);
            });
        auto sample = [&](Entry& entry, bool counts) {
            BuildRow& row = report_.rows[entry.row];
            if (!row.error.empty()) return;
            try {
                const double seconds = time(*entry.subject, input.allow_update);
                if (counts) row.times.push_back(seconds);
            } catch (const std::exception& problem) {
                row.error = problem.what();
                row.times.clear();
                std::fprintf(stderr, "rtc-bench: %s, %s, %s: %s\n", mesh.c_str(), mode, row.by.c_str(),
                             problem.what());
            }
        };
        for (Entry& entry : entries) sample(entry, false);
        const Clock::time_point start = Clock::now();
        for (int repeat = 0; repeat < options_.repeats; ++repeat) {
            for (Entry& entry : entries) sample(entry, true);
            if (repeat >= 2 && std::chrono::duration<double>(Clock::now() - start).count() > options_.seconds) break;
        }
        std::fprintf(stderr, "%s %zu %s done\n", mesh.c_str(), report_.rows.back().primitives, mode);
    }

    double time(BuildSubject& subject, bool update) {
        return device_.time([&](VkCommandBuffer commands) {
            if (update)
                subject.record_update(commands);
            else
                subject.record_build(commands);
        });
    }

    void write_files() const {
        auto write = [](const std::string& name, const std::string& text) {
            if (name.empty()) return;
            std::ofstream file(name);
            if (!(file << text)) throw Error("cannot write " + name);
        };
        write(options_.json_file, as_json(report_).dump(1) + "\n");
        write(options_.markdown_file, report_.device + "\n\n" + build_table(report_));
        write(options_.svg_file, build_plot(report_, options_.meshes[0]));
    }

    const Options options_;
    BenchDevice device_;
    BuildReport report_;
};

}  // namespace

void add_build_command(CLI::App& app) {
    CLI::App& build = *app.add_subcommand(
        "build", "Time and size of acceleration structures, beside the device's own builders where it has one");
    auto options = std::make_shared<Options>();
    build.add_option("--sizes", options->sizes, "numbers of triangles")->delimiter(',')->capture_default_str();
    build.add_option("--meshes", options->meshes, "of blob, soup, strands")->delimiter(',')->capture_default_str();
    build.add_option("--modes", options->modes,
                     "PREFER_FAST_TRACE, PREFER_FAST_BUILD, FAST_TRACE with LOW_MEMORY, an update in place")
        ->delimiter(',')
        ->check(CLI::IsMember({"trace", "fast", "memory", "update"}))
        ->capture_default_str();
    build.add_option("--instances", options->instances, "of the top level; 0: none")->capture_default_str();
    build.add_option("--batch", options->batch, "blobs that are built one by one and in one call; 0: none")
        ->capture_default_str();
    build.add_option("--batch-triangles", options->batch_triangles, "of each of them")->capture_default_str();
    build.add_option("--native", options->native, "of nv, khr; or auto, none")
        ->delimiter(',')
        ->check(CLI::IsMember({"nv", "khr", "auto", "none"}))
        ->capture_default_str();
    build.add_option("--repeats", options->repeats, "timings of each, interleaved; the median counts")
        ->check(CLI::PositiveNumber)
        ->capture_default_str();
    build.add_option("--seconds", options->seconds, "no more timings of a row after this long, but three")
        ->capture_default_str();
    build.add_option("--device", options->device, "index or part of the name; default: $RTC_DEVICE, else the best");
    build.add_flag("--validate", options->validate, "Vulkan validation; any message is an error");
    build.add_option("--json", options->json_file, "write every timing to this file");
    build.add_option("--markdown", options->markdown_file, "write the table to this file");
    build.add_option("--svg", options->svg_file, "write a plot of the first mesh to this file");
    build.callback([options] {
        Bench bench(*options);
        bench.run();
        if (bench.failed()) throw Error("not everything was built; see above");
    });
}

}  // namespace rtc::bench
