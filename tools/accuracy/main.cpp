// rtc-accuracy: what a tier leaks, how exact it is, what it costs.
#include <cmath>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "command_line.h"
#include "commands.h"
#include "error.h"
#include "experiments.h"

namespace {

using namespace rtc::lab;
using rtc::tools::Error;

std::string markdown(const Report& report, const std::string& device) {
    std::ostringstream out;
    char line[512];
    out << "## " << variant_name(report.variant) << " on " << device << "\n\n";
    if (!report.cost.empty()) {
        out << "| workload | triangles | rays | Mrays/s | Mrays per CPU second | turns per ray |\n"
            << "|---|---|---|---|---|---|\n";
        for (const CostRow& r : report.cost) {
            std::snprintf(line, sizeof line, "| %s | %llu | %llu | %.3f | %.3f | %.1f |\n",
                          r.workload.c_str(), (unsigned long long)r.triangles, (unsigned long long)r.rays,
                          r.mrays(), double(r.rays) / r.cpu_seconds / 1e6, r.turns_per_ray);
            out << line;
        }
        out << '\n';
    }
    if (!report.leaks.empty()) {
        out << "Leaks and double hits: rays whose entries and exits do not balance.\n\n"
            << "| axis | value | mesh | aimed at | rays | no candidate | unbalanced | rate, 95 % bound | "
               "promised |\n"
            << "|---|---|---|---|---|---|---|---|---|\n";
        for (const LeakRow& r : report.leaks) {
            std::snprintf(line, sizeof line, "| %s | %s | %s | %s | %llu | %llu | %llu | < %.2g | %s |\n",
                          r.axis.c_str(), r.value.c_str(), r.mesh.c_str(), r.aim.c_str(),
                          (unsigned long long)r.counts.rays, (unsigned long long)r.counts.missed,
                          (unsigned long long)r.counts.unbalanced,
                          upper_bound(r.counts.unbalanced, r.counts.rays), r.must_be_zero ? "0" : "");
            out << line;
        }
        out << '\n';
    }
    if (!report.culls.empty()) {
        out << "False box culls: rays that see other candidates when every box is inflated.\n\n"
            << "| mesh | place | rays | culled |\n|---|---|---|---|\n";
        for (const CullRow& r : report.culls) {
            std::snprintf(line, sizeof line, "| %s | %s | %llu | %llu |\n", r.mesh.c_str(), r.place.c_str(),
                          (unsigned long long)r.rays, (unsigned long long)r.culls);
            out << line;
        }
        out << '\n';
    }
    if (!report.exact.empty()) {
        out << "First hits against exact arithmetic; t error in ulps of the exact t.\n\n"
            << "| scene | rays | hits | missed | invented | other triangle | exact ties | farthest from an "
               "edge | "
               "t p50 | p99 | p99.9 | max |\n|---|---|---|---|---|---|---|---|---|---|---|---|\n";
        for (const ExactRow& r : report.exact) {
            std::snprintf(
                line, sizeof line,
                "| %s | %llu | %llu | %llu | %llu | %llu | %llu | %.2g | %.2f | %.2f | %.2f | %.1f |\n",
                r.scene.c_str(), (unsigned long long)r.rays, (unsigned long long)r.hits,
                (unsigned long long)r.missed, (unsigned long long)r.invented, (unsigned long long)r.wrong,
                (unsigned long long)r.ties, r.worst_margin, r.t_p50, r.t_p99, r.t_p999, r.t_max);
            out << line;
        }
        out << '\n';
    }
    return out.str();
}

nlohmann::ordered_json to_json(const Report& report) {
    nlohmann::ordered_json json;
    json["tier"] = variant_name(report.variant);
    for (const CostRow& r : report.cost) {
        json["cost"].push_back({{"workload", r.workload},
                                {"triangles", r.triangles},
                                {"rays", r.rays},
                                {"mrays_per_second", r.mrays()},
                                {"cpu_seconds", r.cpu_seconds},
                                {"turns_per_ray", r.turns_per_ray}});
    }
    for (const LeakRow& r : report.leaks) {
        json["leaks"].push_back({{"axis", r.axis},
                                 {"value", r.value},
                                 {"mesh", r.mesh},
                                 {"aim", r.aim},
                                 {"rays", r.counts.rays},
                                 {"unbalanced", r.counts.unbalanced},
                                 {"missed", r.counts.missed},
                                 {"bound_95", upper_bound(r.counts.unbalanced, r.counts.rays)},
                                 {"promised_zero", r.must_be_zero}});
    }
    for (const CullRow& r : report.culls) {
        json["culls"].push_back(
            {{"mesh", r.mesh}, {"place", r.place}, {"rays", r.rays}, {"culled", r.culls}});
    }
    for (const ExactRow& r : report.exact) {
        json["exact"].push_back({{"scene", r.scene},
                                 {"rays", r.rays},
                                 {"hits", r.hits},
                                 {"missed", r.missed},
                                 {"invented", r.invented},
                                 {"wrong", r.wrong},
                                 {"ties", r.ties},
                                 {"worst_margin", r.worst_margin},
                                 {"t_ulp_p50", r.t_p50},
                                 {"t_ulp_p99", r.t_p99},
                                 {"t_ulp_p99_9", r.t_p999},
                                 {"t_ulp_max", r.t_max}});
    }
    return json;
}

// What decides the exit code. The watertight tier must be clean where it
// promises to be; the negative control must not be.
bool verdict(const Report& report) {
    uint64_t broken = 0, total = 0;
    for (const LeakRow& r : report.leaks) {
        total += r.counts.unbalanced;
        if (r.must_be_zero) broken += r.counts.unbalanced;
    }
    for (const CullRow& r : report.culls) broken += r.culls;
    if (report.variant == Variant::Watertight && broken) {
        std::fprintf(stderr,
                     "rtc-accuracy: error: watertight: %llu leaks, double hits or false culls where none are "
                     "promised\n",
                     (unsigned long long)broken);
        return false;
    }
    if (report.variant == Variant::Contracted && !report.leaks.empty() && total == 0) {
        std::fprintf(stderr,
                     "rtc-accuracy: error: the negative control does not leak: this measurement is blind\n");
        return false;
    }
    return true;
}

int run(int argc, char** argv) {
    CLI::App app{"Measures leaks, exactness and cost of rtc's traversal on a device.\n"
                 "rtc-accuracy leaks --help: campaigns whose rays the device makes.\n"
                 "rtc-accuracy spawn --help: self-hits of rays that leave surfaces.\n"
                 "rtc-accuracy agree --help: first hits against exact arithmetic."};
    std::vector<std::string> tiers = {"watertight"}, axes = {"mesh"};
    std::string device, json_path, markdown_path;
    uint64_t rays = 1 << 17, exact_rays = 0, cost_rays = 0, cull_rays = 0;
    bool validate = false, while_while = false, storage = false;
    uint32_t shared_stack = 0;
    app.add_option("--tier", tiers, "watertight, fast, exact, exact64, contracted (the negative control) or all")
        ->delimiter(',');
    app.add_option("--device", device, "device index or part of its name");
    app.add_option("--axes", axes, "mesh, offset, size, aspect, distance, transform, zeros, all or none")
        ->delimiter(',');
    app.add_option("--rays", rays, "rays per point and aim");
    app.add_option("--culls", cull_rays, "rays per place for false box culls");
    app.add_option("--exact", exact_rays, "rays per scene against exact arithmetic");
    app.add_option("--cost", cost_rays, "rays per workload for timing");
    app.add_option("--json", json_path, "write all figures");
    app.add_option("--markdown", markdown_path, "write the tables");
    app.add_flag("--validate", validate, "run under the validation layers");
    app.add_flag("--while-while", while_while, "loop form");
    app.add_flag("--storage", storage, "fetch nodes from a storage buffer");
    app.add_option("--shared-stack", shared_stack, "stack entries in shared memory");
    if (const int status = rtc::tools::parse_command_line(app, "rtc-accuracy", argc, argv); status >= 0) return status;
    if (tiers == std::vector<std::string>{"all"}) tiers = {"watertight", "fast", "exact", "exact64", "contracted"};
    if (axes == std::vector<std::string>{"all"}) axes = axis_names();
    if (axes == std::vector<std::string>{"none"}) axes.clear();
    if (rays == 0) throw Error("--rays must not be 0");

    rtc::tools::ContextOptions context_options;
    context_options.device = device;
    context_options.validate = validate;
    context_options.all_core_features = true;  // Float64 for the negative control
    const rtc::tools::Context context(context_options);
    const std::string name = rtc::tools::describe_device(context.properties, context.driver);

    std::string text;
    nlohmann::ordered_json json;
    json["device"] = name;
    bool good = true;
    for (const std::string& tier : tiers) {
        TracerOptions options;
        options.variant = parse_variant(tier);
        options.while_while = while_while;
        options.storage_fetch = storage;
        options.shared_stack = shared_stack;
        if (DeviceTracer::needs_float64(options.variant) && !context.features.shaderFloat64) {
            std::printf("%s: skipped, the device has no Float64\n", tier.c_str());
            continue;
        }
        Report report;
        report.variant = options.variant;
        DeviceTracer tracer(context, options);
        if (cost_rays) {
            // As a pipeline without any-hit and intersection shaders would have it.
            TracerOptions lean = options;
            lean.any_hit = lean.aabbs = lean.resumable = false;
            DeviceTracer lean_tracer(context, lean);
            measure_cost(lean_tracer, cost_rays, report.cost);
        }
        for (const std::string& axis : axes) measure_axis(tracer, axis, rays, report.leaks);
        if (cull_rays) measure_culls(tracer, cull_rays, report.culls);
        if (exact_rays) measure_exact(tracer, exact_rays, report.exact);
        const std::string tables = markdown(report, name);
        std::fputs(tables.c_str(), stdout);
        std::fflush(stdout);  // long runs get interrupted
        text += tables;
        json["tiers"].push_back(to_json(report));
        good = verdict(report) && good;
    }
    if (!markdown_path.empty()) write_file(markdown_path, text);
    if (!json_path.empty()) write_file(json_path, json.dump(2) + "\n");
    if (validate) context.require_silent_validation();
    return good ? 0 : 1;
}

}  // namespace

double rtc::lab::upper_bound(uint64_t events, uint64_t n) {
    if (events == 0) return 3.0 / double(n);
    return (double(events) + 2 * std::sqrt(double(events)) + 2) / double(n);
}

void rtc::lab::write_file(const std::string& path, const std::string& text) {
    std::ofstream file(path, std::ios::binary);
    file << text;
    if (!file.flush()) throw Error("cannot write " + path);
}

int main(int argc, char** argv) {
    return rtc::tools::run_program("rtc-accuracy", [&] {
        const std::string command = argc > 1 ? argv[1] : "";
        if (command == "leaks") return leaks_command(argc - 1, argv + 1);
        if (command == "spawn") return spawn_command(argc - 1, argv + 1);
        if (command == "agree") return agree_command(argc - 1, argv + 1);
        return run(argc, argv);
    });
}
