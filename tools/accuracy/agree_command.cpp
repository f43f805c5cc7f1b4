// rtc-accuracy agree: first hits against exact arithmetic.
#include <cstdio>
#include <nlohmann/json.hpp>
#include <sstream>

#include "agreement.h"
#include "cases.h"
#include "command_line.h"
#include "commands.h"
#include "error.h"
#include "experiments.h"
#include "image_file.h"
#include "pipeline_tracer.h"
#include "transform_error.h"

namespace rtc::lab {
namespace {

std::string markdown(const std::string& tier, const std::string& device, const std::vector<AgreementRow>& rows) {
    std::ostringstream out;
    out << "### " << tier << " on " << device << "\n\n"
        << "| axis | cases | rays | hits | ties | on an edge | with denormals | differ | of these denormal | exact decisions per 1000 rays | "
           "t p50 | p99.9 | max |\n|---|---|---|---|---|---|---|---|---|---|---|---|---|\n";
    AgreementRow all{.axis = "all"};
    auto line = [&](const AgreementRow& r, bool errors) {
        char text[512];
        std::snprintf(text, sizeof text, "| %s | %llu | %llu | %llu | %llu | %llu | %llu | %llu | %llu | %.1f |", r.axis.c_str(),
                      (unsigned long long)r.cases, (unsigned long long)r.rays, (unsigned long long)r.hits,
                      (unsigned long long)r.ties, (unsigned long long)r.on_edge, (unsigned long long)r.with_denormals, (unsigned long long)r.different(),
                      (unsigned long long)r.denormal,
                      1000 * double(r.oracle.edges + r.oracle.orders) / double(std::max<uint64_t>(1, r.rays)));
        out << text;
        std::snprintf(text, sizeof text, " %.2f | %.2f | %.3g |\n", r.t_p50, r.t_p999, r.t_max);
        out << (errors ? text : "  |  |  |\n");
    };
    for (const AgreementRow& r : rows) {
        line(r, true);
        all.add(r);
    }
    line(all, false);
    char text[200];
    std::snprintf(text, sizeof text, "\nTraced in %.0f s, judged in %.0f s, at the same time; %llu decisions took rationals.\n\n",
                  all.device_seconds, all.oracle_seconds, (unsigned long long)all.oracle.rationals);
    out << text;
    for (const AgreementRow& r : rows)
        if (!r.first.empty()) out << "- first difference, " << r.axis << ", " << r.first << '\n';
    return out.str();
}

// One line a transform.
std::string leak_table(const std::vector<LeakRow>& rows) {
    std::string text = "| instance | rays | leaks and double hits |\n|---|---|---|\n";
    for (size_t i = 0; i < rows.size();) {
        uint64_t rays = 0, events = 0;
        const std::string& value = rows[i].value;
        const bool promised = rows[i].must_be_zero;
        for (; i < rows.size() && rows[i].value == value; ++i) {
            rays += rows[i].counts.rays;
            events += rows[i].counts.unbalanced;
        }
        char line[160];
        std::snprintf(line, sizeof line, "| %s%s | %llu | %llu |\n", value.c_str(), promised ? "" : " (nothing promised)",
                      (unsigned long long)rays, (unsigned long long)events);
        text += line;
    }
    return text + "\n";
}

nlohmann::ordered_json to_json(const std::string& tier, const std::vector<AgreementRow>& rows) {
    nlohmann::ordered_json json{{"tier", tier}};
    for (const AgreementRow& r : rows)
        json["agreement"].push_back({{"axis", r.axis},
                                     {"cases", r.cases},
                                     {"rays", r.rays},
                                     {"hits", r.hits},
                                     {"ties", r.ties},
                                     {"on_edge", r.on_edge},
                                     {"missed", r.missed},
                                     {"invented", r.invented},
                                     {"other", r.inverted},
                                     {"with_denormals", r.with_denormals},
                                     {"of_these_denormal", r.denormal},
                                     {"exact_edges", r.oracle.edges},
                                     {"exact_orders", r.oracle.orders},
                                     {"rationals", r.oracle.rationals},
                                     {"t_ulp_p50", r.t_p50},
                                     {"t_ulp_p99", r.t_p99},
                                     {"t_ulp_p99_9", r.t_p999},
                                     {"t_ulp_max", r.t_max},
                                     {"device_seconds", r.device_seconds},
                                     {"oracle_seconds", r.oracle_seconds},
                                     {"first_difference", r.first}});
    return json;
}

}  // namespace

int agree_command(int argc, char** argv) {
    CLI::App app{"First hits on a device against exact arithmetic, over axes that run from the ordinary to the extreme."};
    std::vector<std::string> tiers = {"exact", "exact64"};
    std::string device, json_path, markdown_path;
    AgreementSettings settings;
    std::string addressing;
    bool validate = false, pipeline = false;
    uint64_t leak_rays = 0;
    app.add_option("--tier", tiers, "exact, exact64, watertight, fast, contracted; several with commas")->delimiter(',');
    app.add_option("--device", device, "device index or part of its name");
    app.add_option("--axes", settings.axes, "some of the axes; several with commas")->delimiter(',');
    app.add_option("--rays", settings.rays, "for each tier, over all axes in equal shares")->check(some_rays());
    app.add_option("--threads", settings.threads, "of the host; 0: all cores");
    app.add_option("--seconds", settings.seconds, "stop each tier after about this long, with fewer rays everywhere")
        ->check(tools::number_between(0, 1e9));
    app.add_flag("--pipeline", pipeline, "through pipelines that rtc links, over structures that its runtime builds on the "
                                         "device, as users trace; without, through traversal alone over the oracle's trees");
    app.add_option("--addressing", addressing, "heap or address, with --pipeline; default: as the device recommends");
    app.add_option("--leaks", leak_rays, "with --pipeline: rays as well for each transform, mesh and aim of the axis `transform` "
                                         "of leaks")->check(rays_or_none());
    app.add_option("--json", json_path, "write all figures");
    app.add_option("--markdown", markdown_path, "write the tables");
    app.add_flag("--validate", validate, "run under the validation layers");
    app.add_flag("--quiet", settings.quiet, "no progress");
    if (const int status = tools::parse_command_line(app, "rtc-accuracy agree", argc, argv); status >= 0) return status;
    if (!pipeline && (!addressing.empty() || leak_rays))
        throw tools::Error("--addressing and --leaks go with --pipeline");
    for (const std::string& axis : settings.axes) exact_cases(axis);  // names what is wrong before anything runs

    for (const std::string& path : {json_path, markdown_path})
        if (!path.empty()) tools::require_writable(path);
    tools::ContextOptions context_options;
    context_options.device = device;
    context_options.validate = validate;
    context_options.all_core_features = true;  // Float64 for exact64
    const tools::Context context(context_options);
    const std::string name = tools::describe_device(context.properties, context.driver);
    std::string text;
    nlohmann::ordered_json json{{"device", name}};
    bool good = true;
    for (const std::string& tier : tiers) {
        TracerOptions options;
        options.variant = parse_variant(tier);
        std::string subject = tier;
        options.step_budget = 7000;
        options.pause = true;
        options.aabbs = options.any_hit = false;  // the cases are opaque triangles: the way most pipelines go
        if (DeviceTracer::needs_float64(options.variant) && !context.features.shaderFloat64) {
            std::printf("%s: skipped: the device has no shaderFloat64\n", tier.c_str());
            continue;
        }
        std::vector<AgreementRow> rows;
        std::string more;
        std::vector<TransformError> transforms;
        std::vector<LeakRow> leaks;
        try {
            if (pipeline) {
                PipelineTracerOptions whole;
                whole.tier = tier;
                whole.addressing = tools::addressing_from_name(addressing);
                // Small launches for few rays: lanes without a ray are not free on a CPU.
                if (settings.rays <= 1'000'000) whole.lanes = 4096;
                const auto tracer = make_pipeline_tracer(context, whole);
                subject += tracer->by_address() ? ", linked pipelines, address mode" : ", linked pipelines, heap";
                rows = measure_agreement(*tracer, settings);
                transforms = measure_transform_errors(*tracer, 400);
                more = "Object-space rays against the exact inverse, at most:\n\n" + transform_table(transforms) + "\n";
                if (leak_rays) {
                    whole.any_hit = true;
                    measure_axis(*make_pipeline_tracer(context, whole), "transform", leak_rays, leaks);
                    more += leak_table(leaks);
                }
            } else {
                DeviceTracer tracer(context, options);
                rows = measure_agreement(tracer, settings);
            }
        } catch (const tools::Error& problem) {  // the others may still run
            std::fprintf(stderr, "rtc-accuracy: error: %s: %s\n", tier.c_str(), problem.what());
            good = false;
            continue;
        }
        const std::string tables = markdown(subject, name, rows) + more;
        std::fputs(tables.c_str(), stdout);
        std::fflush(stdout);
        text += tables;
        json["tiers"].push_back(to_json(subject, rows));
        for (const TransformError& e : transforms)
            json["tiers"].back()["transforms"].push_back({{"transform", e.name},
                                                          {"origin_ulps", e.origin},
                                                          {"direction_ulps", e.direction},
                                                          {"share_of_widening", e.of_padding}});
        for (const LeakRow& r : leaks)
            json["tiers"].back()["leaks"].push_back({{"transform", r.value},
                                                     {"mesh", r.mesh},
                                                     {"aim", r.aim},
                                                     {"promised_zero", r.must_be_zero},
                                                     {"rays", r.counts.rays},
                                                     {"unbalanced", r.counts.unbalanced}});
        uint64_t different = 0;
        for (const AgreementRow& r : rows) different += r.different() - r.denormal;
        const bool exact = options.variant == Variant::Exact || options.variant == Variant::Exact64;
        if (exact && different) {
            std::fprintf(stderr, "rtc-accuracy: error: %s: %llu hits differ from exact arithmetic\n", tier.c_str(),
                         (unsigned long long)different);
            good = false;
        }
        uint64_t unbalanced = 0;
        for (const LeakRow& r : leaks) unbalanced += r.must_be_zero ? r.counts.unbalanced : 0;
        if (tier != "fast" && unbalanced) {
            std::fprintf(stderr, "rtc-accuracy: error: %s: %llu leaks or double hits under transforms where none are promised\n",
                         tier.c_str(), (unsigned long long)unbalanced);
            good = false;
        }
        if (!json_path.empty()) write_file(json_path, json.dump(1) + "\n");
        if (!markdown_path.empty()) write_file(markdown_path, text);
    }
    if (context.validating()) context.require_silent_validation();
    return good ? 0 : 1;
}

}  // namespace rtc::lab
