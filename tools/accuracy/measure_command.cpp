// rtc-accuracy without a command: cost and errors of rtc's tiers, the device's own ray tracing and Embree on the same
// rays, as one table and one plot.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <nlohmann/json.hpp>

#include "campaign.h"
#include "command_line.h"
#include "commands.h"
#include "embree_tracer.h"
#include "error.h"
#include "experiments.h"
#include "image_file.h"
#include "native_tracer.h"
#include "payloads.h"
#include "report.h"

namespace rtc::lab {
namespace {

using tools::Error;
using Json = nlohmann::ordered_json;

const std::vector<std::string> kAll = {"fast",       "watertight", "exact",       "exact64",
                                       "contracted", "native",     "embree-fast", "embree-robust",
                                       "box16", "box8", "float-inverse", "t64"};

bool is_embree(const std::string& name) { return name == "embree-fast" || name == "embree-robust"; }

struct Settings {
    std::string device;
    std::vector<std::string> axes;
    uint64_t rays = 1 << 17, cull_rays = 0, first_hits = 0, self_hits = 0, cost_rays = 0;
    unsigned repeats = 7;
    double seconds = 0;
    bool validate = false, while_while = false, storage = false, quiet = false;
    uint32_t shared_stack = 0;
};

// One thing that traces, in the forms that the experiments want.
class Subject {
  public:
    Subject(std::string name, const Settings& settings) : name_(std::move(name)) {
        if (is_embree(name_)) {
            counting_ = make_embree_tracer(name_ == "embree-fast" ? EmbreeMode::Fast : EmbreeMode::Robust);
            by_cpu_ = true;
            return;
        }
        context_ = campaign_context(is_knob(name_) ? "watertight" : name_, settings.device, settings.validate);
        device_ = tools::describe_device(context_->properties, context_->driver);
        by_cpu_ = context_->properties.deviceType == VK_PHYSICAL_DEVICE_TYPE_CPU;
        if (name_ == "native") {
            counting_ = make_native_tracer(*context_, true);
            first_hits_ = make_native_tracer(*context_, false);
            return;
        }
        TracerOptions& options = options_;
        options.variant = parse_variant(name_);
        if (DeviceTracer::needs_float64(options.variant) && !context_->features.shaderFloat64)
            throw tools::MissingFeature(name_ + " needs shaderFloat64");
        options.while_while = settings.while_while;
        options.storage_fetch = settings.storage;
        options.shared_stack = settings.shared_stack;
        options.aabbs = false;
        // Lavapipe 22.3 ends loops of many turns.
        options.step_budget = 7000;
        options.pause = true;
    }

    // Made when they are wanted: each is a pipeline to compile.
    RayTracer& counting() {
        if (!counting_) counting_ = std::make_unique<DeviceTracer>(*context_, options_);
        return *counting_;
    }
    RayTracer& first_hits() {
        if (is_embree(name_)) return *counting_;
        if (!first_hits_) {
            TracerOptions options = options_;
            options.any_hit = false;
            first_hits_ = std::make_unique<DeviceTracer>(*context_, options);
        }
        return *first_hits_;
    }
    RayTracer& cost() {
        if (is_embree(name_) || name_ == "native") return first_hits();
        if (!cost_) {  // as a pipeline without any-hit and intersection shaders would have it
            TracerOptions options = options_;
            options.any_hit = options.resumable = options.pause = false;
            options.step_budget = 0xffffffffu;
            cost_ = std::make_unique<DeviceTracer>(*context_, options);
        }
        return *cost_;
    }
    const tools::Context* context() const { return context_.get(); }
    const std::string& device() const { return device_; }
    bool by_cpu() const { return by_cpu_; }

  private:
    std::string name_, device_;
    std::unique_ptr<tools::Context> context_;
    TracerOptions options_;
    std::unique_ptr<RayTracer> counting_, first_hits_, cost_;
    bool by_cpu_ = false;
};

SelfHits measure_self_hits(const tools::Context& context, const std::string& subject, uint64_t rays, double seconds) {
    const std::vector<CampaignPoint> points = spawn_points();
    const auto tracer = make_campaign_tracer(context, subject, CampaignProgram::Spawn, points);
    CampaignSettings settings;
    settings.program = CampaignProgram::Spawn;
    settings.rays = rays;
    settings.seconds = seconds;
    settings.quiet = true;
    SelfHits sum;
    for (const CampaignRow& row : run_campaign(*tracer, points, false, settings).rows) {
        const bool thin = row.mesh.rfind("slivers", 0) == 0;
        (thin ? sum.thin_rays : sum.rays) += row.rays;
        (thin ? sum.thin_hits : sum.hits) += row.events;
    }
    return sum;
}

// A line a member, and a line a tier: small, and fit for version control.
std::string lines_of(const Json& json) {
    std::string text = "{\n";
    for (auto member = json.begin(); member != json.end(); ++member) {
        text += " " + Json(member.key()).dump() + ": ";
        if (member.key() == "tiers") {
            text += "[\n";
            for (const Json& tier : member.value()) text += tier.dump() + (&tier == &member.value().back() ? "\n" : ",\n");
            text += " ]";
        } else {
            text += member.value().dump();
        }
        text += std::next(member) == json.end() ? "\n" : ",\n";
    }
    return text + "}\n";
}

Json to_json(const Report& report) {
    Json json{{"tier", report.subject}};
    if (!report.problem.empty()) json["problem"] = report.problem;
    if (!report.cost_problem.empty()) json["problem"] = "cost: " + report.cost_problem;
    for (const CostRow& r : report.cost)
        json["cost"].push_back({{"workload", r.workload},
                                {"triangles", r.triangles},
                                {"rays", r.rays},
                                {"seconds", r.seconds},
                                {"cpu_time", r.by_cpu},
                                {"against_first", r.against_first},
                                {"turns_per_ray", r.turns_per_ray},
                                {"scene_bytes", r.scene_bytes}});
    for (const LeakRow& r : report.leaks)
        json["leaks"].push_back({{"axis", r.axis},
                                 {"value", r.value},
                                 {"mesh", r.mesh},
                                 {"aim", r.aim},
                                 {"rays", r.counts.rays},
                                 {"unbalanced", r.counts.unbalanced},
                                 {"missed", r.counts.missed},
                                 {"looked_at", r.counts.looked_at},
                                 {"of_these_leaks", r.counts.leaks},
                                 {"of_these_doubles", r.counts.doubles},
                                 {"seconds", r.counts.seconds},
                                 {"promised_zero", r.must_be_zero}});
    for (const CullRow& r : report.culls)
        json["culls"].push_back({{"mesh", r.mesh}, {"place", r.place}, {"rays", r.rays}, {"culled", r.culls}});
    for (const AgreementRow& r : report.agreement)
        json["agreement"].push_back({{"axis", r.axis},
                                     {"cases", r.cases},
                                     {"rays", r.rays},
                                     {"hits", r.hits},
                                     {"missed", r.missed},
                                     {"invented", r.invented},
                                     {"other", r.inverted},
                                     {"of_these_denormal", r.denormal},
                                     {"by_rule", r.by_rule},
                                     {"missed_plainly", r.missed_plainly},
                                     {"invented_plainly", r.invented_plainly},
                                     {"later", r.later},
                                     {"t_ulp_p50", r.t_p50},
                                     {"t_ulp_p99", r.t_p99},
                                     {"t_ulp_p99_9", r.t_p999},
                                     {"t_ulp_max", r.t_max},
                                     {"weights_p50", r.b_p50},
                                     {"weights_p99_9", r.b_p999},
                                     {"weights_max", r.b_max},
                                     {"farthest_from_edge", r.margin},
                                     {"first_difference", r.first}});
    if (report.self_hits.rays)
        json["self_hits"] = {{"rays", report.self_hits.rays},
                             {"hits", report.self_hits.hits},
                             {"thin_rays", report.self_hits.thin_rays},
                             {"thin_hits", report.self_hits.thin_hits}};
    return json;
}

// What decides the exit code. The tiers must be clean where they promise to be; the negative control must not be.
bool verdict(const Report& report) {
    uint64_t broken = 0, total = 0;
    for (const LeakRow& r : report.leaks) {
        total += r.counts.unbalanced;
        if (r.must_be_zero) broken += r.counts.unbalanced;
    }
    for (const CullRow& r : report.culls) broken += r.culls;
    if (report.subject == "watertight" && broken) {
        std::fprintf(stderr,
                     "rtc-accuracy: error: watertight: %llu leaks, double hits or false culls where none are promised\n",
                     (unsigned long long)broken);
        return false;
    }
    if (report.subject == "contracted" && !report.leaks.empty() && total == 0) {
        std::fprintf(stderr, "rtc-accuracy: error: the negative control does not leak: this measurement is blind\n");
        return false;
    }
    uint64_t differ = 0;
    for (const AgreementRow& r : report.agreement)
        if (r.axis == "all" || r.axis == "ordinary") differ += r.different() - r.denormal;
    if ((report.subject == "exact" || report.subject == "exact64") && differ) {
        std::fprintf(stderr, "rtc-accuracy: error: %s: %llu hits differ from exact arithmetic\n", report.subject.c_str(),
                     (unsigned long long)differ);
        return false;
    }
    return true;
}

double seconds_since(std::chrono::steady_clock::time_point start) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// How many of `rays` can be measured in `seconds`, by a try with a few; 0 seconds: no limit.
template <typename Run>
uint64_t affordable(uint64_t rays, uint64_t few, double seconds, Run run) {
    if (seconds <= 0 || rays <= few) return rays;
    const auto start = std::chrono::steady_clock::now();
    run(few);
    return std::clamp(uint64_t(double(few) * seconds / seconds_since(start)), few, rays);
}

// `seconds`: about as long; 0: as long as it takes.
void measure(Subject& subject, Report& report, const Settings& settings, double seconds) {
    auto leaks = [&](uint64_t rays) {
        report.leaks.clear();
        for (const std::string& axis : settings.axes) measure_axis(subject.counting(), axis, rays, report.leaks);
    };
    auto culls = [&](uint64_t rays) {
        report.culls.clear();
        measure_culls(subject.counting(), rays, report.culls);
    };
    auto first_hits = [&](uint64_t rays) {
        AgreementSettings agreement;
        agreement.rays = rays;
        agreement.quiet = true;
        AgreementRow total;
        report.agreement = measure_agreement(subject.first_hits(), agreement, &total);
        report.agreement.push_back(total);
        agreement.axes = {"ordinary"};
        report.agreement.push_back(measure_agreement(subject.first_hits(), agreement).at(0));
    };
    if (!settings.axes.empty()) leaks(affordable(settings.rays, 512, 0.45 * seconds, leaks));
    // Inflated boxes are rtc's trees'.
    const bool own = report.subject != "native" && !is_embree(report.subject);
    if (settings.cull_rays && own) culls(affordable(settings.cull_rays, 256, 0.1 * seconds, culls));
    if (settings.first_hits) first_hits(affordable(settings.first_hits, 8192, 0.3 * seconds, first_hits));
    const bool spawns = report.subject == "fast" || report.subject == "watertight" || report.subject == "exact" ||
                        report.subject == "native";
    if (settings.self_hits && subject.context() && spawns)
        report.self_hits = measure_self_hits(*subject.context(), report.subject, settings.self_hits, 0.15 * seconds);
}

// As it can be repeated: without paths and device, which are the reader's.
std::string command_of(int argc, char** argv) {
    std::string text = "`rtc-accuracy";
    for (int i = 1; i < argc; ++i) {
        const std::string argument = argv[i];
        if (argument == "--json" || argument == "--markdown" || argument == "--plot" || argument == "--device") {
            ++i;
        } else if (argument != "--quiet") {
            text += " " + argument;
        }
    }
    const std::time_t now = std::time(nullptr);
    char date[32];
    std::strftime(date, sizeof date, "%Y-%m-%d", std::gmtime(&now));
    return text + "`, " + date;
}

}  // namespace

int measure_command(int argc, char** argv) {
    CLI::App app{"Measures leaks, exactness and cost of rtc's traversal on a device, of the device's own ray tracing and\n"
                 "of Embree, on the same rays.\n"
                 "rtc-accuracy leaks --help: campaigns whose rays the device makes.\n"
                 "rtc-accuracy spawn --help: self-hits of rays that leave surfaces.\n"
                 "rtc-accuracy agree --help: first hits against exact arithmetic.\n"
                 "rtc-accuracy report --help: tables and plots from what --json wrote.\n"
                 "rtc-accuracy check --help: whether fresh runs agree with earlier ones."};
    std::vector<std::string> tiers = {"watertight"};
    std::string json_path, markdown_path, plot_path;
    Settings settings;
    settings.axes = {"mesh"};
    app.add_option("--tier", tiers,
                   "fast, watertight, exact, exact64, contracted (the negative control), native, embree-fast, "
                   "embree-robust, the laboratory's box16, box8, float-inverse, t64, or all; times are compared with the first's")
        ->delimiter(',');
    app.add_option("--device", settings.device, "device index or part of its name");
    app.add_option("--axes", settings.axes, "mesh, offset, size, aspect, distance, transform, zeros, all or none")
        ->delimiter(',');
    app.add_option("--rays", settings.rays, "rays per point and aim")->check(some_rays());
    app.add_option("--culls", settings.cull_rays, "rays per place for false box culls")->check(rays_or_none());
    app.add_option("--first-hits", settings.first_hits, "rays against exact arithmetic, over all axes of `agree`, and as many "
                                                        "ordinary ones")->check(rays_or_none());
    app.add_option("--self-hits", settings.self_hits, "rays that leave surfaces, for each aim")->check(rays_or_none());
    app.add_option("--cost", settings.cost_rays, "rays per workload for the cost")->check(rays_or_none());
    app.add_option("--seconds", settings.seconds, "fewer rays where that would take longer in all; costs come on top")
        ->check(tools::number_between(0, 1e9));
    app.add_option("--repeats", settings.repeats, "times that the cost is measured, in turns")->check(tools::number_between(1, 1e6));
    app.add_option("--json", json_path, "write all figures");
    app.add_option("--markdown", markdown_path, "write the table");
    app.add_option("--plot", plot_path, "write cost against error as .svg or .png");
    app.add_flag("--validate", settings.validate, "run under the validation layers");
    app.add_flag("--while-while", settings.while_while, "inner loop over nodes");
    app.add_flag("--storage-fetch", settings.storage, "fetch nodes from a storage buffer");
    app.add_option("--shared-stack", settings.shared_stack, "stack entries in shared memory");
    app.add_flag("--quiet", settings.quiet, "no progress");
    if (const int status = tools::parse_command_line(app, "rtc-accuracy", argc, argv); status >= 0) return status;
    if (tiers == std::vector<std::string>{"all"}) tiers = kAll;
    if (settings.axes == std::vector<std::string>{"all"}) settings.axes = axis_names();
    if (settings.axes == std::vector<std::string>{"none"}) settings.axes.clear();
    for (const std::string& axis : settings.axes)
        if (std::find(axis_names().begin(), axis_names().end(), axis) == axis_names().end()) {
            std::string known;
            for (const std::string& name : axis_names()) known += name + ", ";
            throw Error("unknown axis \"" + axis + "\": one of " + known + "all or none");
        }
    if (!plot_path.empty() && !plot_path.ends_with(".svg") && !plot_path.ends_with(".png"))
        throw Error("--plot: \"" + plot_path + "\" ends neither in .svg nor in .png");
    for (const std::string& path : {json_path, markdown_path, plot_path})
        if (!path.empty()) tools::require_writable(path);
    for (const std::string& tier : tiers)
        if (std::find(kAll.begin(), kAll.end(), tier) == kAll.end()) {
            std::string known;
            for (const std::string& name : kAll) known += ", " + name;
            throw Error("unknown tier \"" + tier + "\": one of" + known.substr(1) + " or all");
        }

    const auto start = std::chrono::steady_clock::now();
    const std::string command = command_of(argc, argv);
    std::string device;
    bool by_cpu = true, good = true;
    std::vector<std::unique_ptr<Subject>> subjects(tiers.size());
    std::vector<Report> reports(tiers.size());
    auto attempt = [&](size_t i, auto&& work) {
        if (!reports[i].problem.empty()) return;
        try {
            work();
        } catch (const tools::MissingFeature& problem) {  // the others may still run
            reports[i].problem = std::string("skipped: ") + problem.what();
            std::printf("%s: %s\n", tiers[i].c_str(), reports[i].problem.c_str());
        } catch (const Error& problem) {
            reports[i].problem = problem.what();
            if (tiers[i] == "native" && !subjects[i]) return;  // few devices have it
            std::fprintf(stderr, "rtc-accuracy: error: %s: %s\n", tiers[i].c_str(), problem.what());
            good = false;
        }
    };
    for (size_t i = 0; i < tiers.size(); ++i) {
        reports[i].subject = tiers[i];
        attempt(i, [&] { subjects[i] = std::make_unique<Subject>(tiers[i], settings); });
        if (subjects[i] && subjects[i]->context()) {
            device = subjects[i]->device();
            by_cpu = subjects[i]->by_cpu();
        }
    }
    if (std::none_of(subjects.begin(), subjects.end(), [](const auto& s) { return s != nullptr; }))
        throw Error("nothing can be measured" + (reports[0].problem.empty() ? "" : ": " + reports[0].problem));
    if (settings.cost_rays) {
        std::vector<CostSubject> costs;
        for (size_t i = 0; i < tiers.size(); ++i)
            if (subjects[i]) attempt(i, [&] { costs.push_back({&subjects[i]->cost(), &reports[i], subjects[i]->by_cpu()}); });
        measure_cost(costs, settings.cost_rays, settings.repeats);
        for (size_t i = 0; i < tiers.size(); ++i)
            if (subjects[i] && !reports[i].cost_problem.empty()) {
                std::fprintf(stderr, "rtc-accuracy: error: %s: cost: %s\n", tiers[i].c_str(), reports[i].cost_problem.c_str());
                good = false;
            }
    }
    std::vector<PayloadRow> payloads;
    const auto with_knob = std::find_if(tiers.begin(), tiers.end(), is_knob);
    if (settings.cost_rays && with_knob != tiers.end() && subjects[size_t(with_knob - tiers.begin())]) {
        try {
            const uint32_t side = std::max(64u, uint32_t(std::sqrt(double(settings.cost_rays) / 2)) & ~7u);
            payloads = measure_payloads(*subjects[size_t(with_knob - tiers.begin())]->context(), side, settings.repeats);
        } catch (const Error& problem) {
            std::fprintf(stderr, "rtc-accuracy: error: payloads: %s\n", problem.what());
            good = false;
        }
    }
    auto results = [&] {
        Json json{{"device", device.empty() ? "the host" : device}, {"by_cpu", by_cpu}, {"command", command}};
        for (const Report& report : reports) json["tiers"].push_back(to_json(report));
        for (const PayloadRow& p : payloads)
            json["payload"].push_back({{"name", p.name},
                                       {"bytes", p.bytes},
                                       {"seconds", p.seconds},
                                       {"against_first", p.against_first},
                                       {"colour_error_mean", p.colour_error_mean},
                                       {"colour_error_max", p.colour_error_max}});
        return json;
    };
    for (size_t i = 0; i < tiers.size(); ++i) {
        if (!settings.quiet) std::fprintf(stderr, "%s ...\n", tiers[i].c_str());
        const double left = std::max(1.0, settings.seconds - seconds_since(start)) / double(tiers.size() - i);
        attempt(i, [&] { measure(*subjects[i], reports[i], settings, settings.seconds > 0 ? left : 0); });
        good = verdict(reports[i]) && good;
        if (!json_path.empty()) write_file(json_path, lines_of(results()));  // long runs get interrupted
    }
    const Json json = results();
    const DeviceReport summary = summarise({json}).at(0);
    const std::string table = markdown_table(summary, "") + "\n" + knob_table(summary);
    std::fputs(table.c_str(), stdout);
    if (!markdown_path.empty()) write_file(markdown_path, table);
    if (plot_path.ends_with(".svg")) write_file(plot_path, plot_svg(summary));
    if (plot_path.ends_with(".png")) write_plot_png(summary, plot_path);
    if (!json_path.empty()) write_file(json_path, lines_of(json));
    for (const auto& subject : subjects)
        if (subject && subject->context() && subject->context()->validating()) subject->context()->require_silent_validation();
    return good ? 0 : 1;
}

}  // namespace rtc::lab
