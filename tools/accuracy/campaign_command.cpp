// rtc-accuracy leaks, rtc-accuracy spawn: campaigns on the device.
#include <algorithm>
#include <cstdio>
#include <functional>
#include <nlohmann/json.hpp>
#include <sstream>

#include "campaign.h"
#include "command_line.h"
#include "commands.h"
#include "error.h"
#include "image_file.h"

namespace rtc::lab {
namespace {

using tools::Error;

// Sums of rows that agree in some columns, in the order in which they came.
std::vector<std::pair<std::string, CampaignRow>> summed(const CampaignReport& report, bool promised,
                                                        const std::function<std::string(const CampaignRow&)>& key) {
    std::vector<std::pair<std::string, CampaignRow>> sums;
    for (const CampaignRow& row : report.rows) {
        if (row.promised != promised) continue;
        const std::string name = key(row);
        auto at = std::find_if(sums.begin(), sums.end(), [&](const auto& entry) { return entry.first == name; });
        if (at == sums.end()) {
            sums.emplace_back(name, row);
            continue;
        }
        at->second.rays += row.rays;
        at->second.events += row.events;
        at->second.missed += row.missed;
        at->second.seconds += row.seconds;
    }
    return sums;
}

std::string offset_text(double offset) {
    char text[16];
    std::snprintf(text, sizeof text, offset == 0 ? "0" : "%.0e", offset);
    return text;
}

const char* event_name(CampaignProgram program) {
    return program == CampaignProgram::Leaks ? "unbalanced" : "self_hits";
}

void table(std::ostringstream& out, CampaignProgram program, const char* columns, const std::vector<std::pair<std::string, CampaignRow>>& rows) {
    int count = 1;
    for (const char* c = columns; *c; ++c) count += *c == '|';
    out << "| " << columns << " | rays | no candidate | "
        << (program == CampaignProgram::Leaks ? "unbalanced" : "self-hits") << " | rate, 95 % bound | Mrays/s |\n|";
    for (int i = 0; i < count + 5; ++i) out << "---|";
    out << '\n';
    for (const auto& [name, row] : rows) {
        char line[256];
        std::snprintf(line, sizeof line, "| %s | %llu | %llu | %llu | < %.2g | %.2f |\n", name.c_str(),
                      (unsigned long long)row.rays, (unsigned long long)row.missed,
                      (unsigned long long)row.events, upper_bound(row.events, row.rays),
                      row.seconds > 0 ? double(row.rays) / row.seconds * 1e-6 : 0.0);
        out << line;
    }
    out << '\n';
}

std::string markdown(const CampaignReport& report, CampaignProgram program) {
    std::ostringstream out;
    out << "### " << report.subject << " on " << report.device << "\n\n";
    if (report.rays(true)) {
        table(out, program, "mesh | aimed at",
              summed(report, true, [](const CampaignRow& r) { return r.mesh + " | " + r.aim; }));
        table(out, program, "offset | in | instance",
              summed(report, true, [](const CampaignRow& r) {
                  return offset_text(r.offset) + " | " + r.place + " | " + r.transform;
              }));
    }
    if (report.rays(false) && program == CampaignProgram::Spawn)
        table(out, program, "nothing promised: mesh | aimed at",
              summed(report, false, [](const CampaignRow& r) { return r.mesh + " | " + r.aim; }));
    else if (report.rays(false))
        table(out, program, "beyond the promise: offset | aimed at", summed(report, false, [](const CampaignRow& r) {
                  return offset_text(r.offset) + " | " + r.aim;
              }));
    if (program == CampaignProgram::Spawn) return out.str();
    size_t leaks = 0, doubles = 0, strange = 0;
    for (const CampaignOffender& o : report.offenders) {
        const uint32_t got = o.front + o.back, due = o.closest ? 1 : o.exact.front + o.exact.back;
        leaks += got < due;
        doubles += got > due;
        strange += !o.same_ray;
    }
    if (!report.offenders.empty())
        out << "Of " << report.offenders.size() << " unbalanced rays looked at in exact arithmetic, " << leaks
            << " missed something and " << doubles << " hit something too much.\n\n";
    if (strange) out << strange << " of them are not what the host makes of their number.\n\n";
    return out.str();
}

nlohmann::ordered_json to_json(const CampaignReport& report, CampaignProgram program) {
    nlohmann::ordered_json json{{"tier", report.subject}, {"seed", report.seed}};
    for (const CampaignRow& r : report.rows)
        json[program == CampaignProgram::Leaks ? "campaign" : "spawn"].push_back({{"mesh", r.mesh},
                                    {"transform", r.transform},
                                    {"offset", r.offset},
                                    {"offset_in", r.place},
                                    {"aim", r.aim},
                                    {"promised_zero", r.promised},
                                    {"rays", r.rays},
                                    {event_name(program), r.events},
                                    {"missed", r.missed},
                                    {"seconds", r.seconds}});
    for (const CampaignOffender& o : report.offenders) {
        const CampaignRow& r = report.rows[o.row];
        char ray[256];
        std::snprintf(ray, sizeof ray, "o %a %a %a d %a %a %a", o.origin.x, o.origin.y, o.origin.z, o.direction.x,
                      o.direction.y, o.direction.z);
        json["offenders"].push_back({{"at", r.mesh + ", " + r.transform + ", " + r.place + " + " +
                                                offset_text(r.offset) + ", " + r.aim},
                                     {"promised", r.promised},
                                     {"number", o.number},
                                     {"ray", ray},
                                     {"front", o.front},
                                     {"back", o.back},
                                     {"exact_front", o.exact.front},
                                     {"exact_back", o.exact.back},
                                     {"touched", o.exact.touched},
                                     {"nearest_edge", o.exact.nearest_edge},
                                     {"closest", o.closest},
                                     {"same_ray", o.same_ray}});
    }
    return json;
}

// What decides the exit code.
bool verdict(const CampaignReport& report, const CampaignSettings& settings) {
    const uint64_t broken = report.events(true);
    if (settings.naive) {
        if (broken == 0) std::fprintf(stderr, "rtc-accuracy: error: the control has no self-hits: this measurement is blind\n");
        return broken != 0;
    }
    if (report.subject == "watertight" || report.subject == "exact" || report.subject == "exact64") {
        if (!broken) return true;
        std::fprintf(stderr, "rtc-accuracy: error: %s: %llu %s where none are promised\n",
                     report.subject.c_str(), (unsigned long long)broken,
                     settings.program == CampaignProgram::Leaks ? "leaks or double hits" : "self-hits");
        return false;
    }
    if (report.subject == "contracted" && settings.program == CampaignProgram::Leaks && broken == 0) {
        std::fprintf(stderr,
                     "rtc-accuracy: error: the negative control does not leak: this measurement is blind\n");
        return false;
    }
    return true;
}

int campaign_command(CampaignProgram program, int argc, char** argv) {
    const bool leaks = program == CampaignProgram::Leaks;
    CLI::App app{leaks ? "Leaks: rays aimed at edges and vertices of closed meshes, made on the device."
                       : "Self-hits: rays that leave triangles from the origins of rtc/spawn.glsl, made on the device."};
    std::vector<std::string> tiers = {"watertight"};
    std::string device, json_path, markdown_path;
    CampaignSettings settings;
    settings.program = program;
    uint32_t lanes = 0;
    bool validate = false;
    app.add_option("--tier", tiers, "watertight, fast, exact, exact64, contracted (the negative control) or "
                                    "native (the device's VK_KHR_ray_tracing_pipeline); several with commas")
        ->delimiter(',');
    app.add_option("--device", device, "device index or part of its name");
    app.add_option("--rays", settings.rays, leaks ? "rays aimed at edges, and as many at vertices"
                                                  : "rays aimed inside, and as many at edges and at vertices")
        ->check(some_rays());
    if (leaks)
        app.add_option("--beyond", settings.beyond, "the same for offsets of 1e5 to 1e8, where nothing is promised")
            ->check(rays_or_none());
    else
        app.add_flag("--naive", settings.naive, "the control: second rays start where t says, and must hit themselves");
    app.add_option("--seconds", settings.seconds, "stop each tier after about this long, with fewer rays everywhere")
        ->check(tools::number_between(0, 1e9));
    app.add_option("--seed", settings.seed, "the same seed makes the same rays");
    app.add_option("--lanes", lanes, "rays of one launch")->check(tools::number_between(0, 1u << 28));
    app.add_option("--json", json_path, "write all figures");
    app.add_option("--markdown", markdown_path, "write the tables");
    app.add_flag("--validate", validate, "run under the validation layers");
    app.add_flag("--quiet", settings.quiet, "no progress");
    const char* name = leaks ? "rtc-accuracy leaks" : "rtc-accuracy spawn";
    if (const int status = tools::parse_command_line(app, name, argc, argv); status >= 0) return status;

    for (const std::string& path : {json_path, markdown_path})
        if (!path.empty()) tools::require_writable(path);
    const std::vector<CampaignPoint> within = leaks ? campaign_points(false) : spawn_points();
    const std::vector<CampaignPoint> beyond = settings.beyond ? campaign_points(true) : std::vector<CampaignPoint>();
    std::string text;
    nlohmann::ordered_json json;
    bool good = true;
    for (const std::string& tier : tiers) {
        std::unique_ptr<tools::Context> context;
        CampaignReport report;
        try {
            context = campaign_context(tier, device, validate);
            const auto tracer = make_campaign_tracer(*context, tier, program, within, lanes);
            report = run_campaign(*tracer, within, false, settings);
        } catch (const tools::MissingFeature& problem) {
            std::printf("%s: skipped: %s\n", tier.c_str(), problem.what());
            continue;
        } catch (const Error& problem) {  // the others may still run
            std::fprintf(stderr, "rtc-accuracy: error: %s: %s\n", tier.c_str(), problem.what());
            good = false;
            continue;
        }
        if (settings.beyond) {
            const auto tracer = make_campaign_tracer(*context, tier, program, beyond, lanes);
            const CampaignReport more = run_campaign(*tracer, beyond, true, settings);
            for (CampaignOffender o : more.offenders) {
                o.row += report.rows.size();
                report.offenders.push_back(o);
            }
            report.rows.insert(report.rows.end(), more.rows.begin(), more.rows.end());
        }
        report.subject = settings.naive ? tier + ", naive origins" : tier;
        report.device = tools::describe_device(context->properties, context->driver);
        const std::string tables = markdown(report, program);
        std::fputs(tables.c_str(), stdout);
        std::fflush(stdout);
        text += tables;
        json["device"] = report.device;
        json["tiers"].push_back(to_json(report, program));
        good = verdict(report, settings) && good;
        if (context->validating()) context->require_silent_validation();
        if (!json_path.empty()) write_file(json_path, json.dump(1) + "\n");  // long runs get interrupted
        if (!markdown_path.empty()) write_file(markdown_path, text);
    }
    return good ? 0 : 1;
}

}  // namespace

int leaks_command(int argc, char** argv) { return campaign_command(CampaignProgram::Leaks, argc, argv); }
int spawn_command(int argc, char** argv) { return campaign_command(CampaignProgram::Spawn, argc, argv); }

}  // namespace rtc::lab
