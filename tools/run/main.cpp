// rtc-run: runs any ray tracing pipeline without an engine around it.
#include <cstdio>
#include <filesystem>

#include "command_line.h"
#include "backend.h"
#include "files.h"
#include "report.h"

namespace rtc::run {
namespace {

using tools::Error;

struct CommandLine {
    std::vector<std::string> stages, hit_groups, binds, specs, outputs, defines, include_dirs, variants;
    std::string scene, size, native_kind, device, case_file, push, table, suite, filter, json, save, oracle,
        save_oracle;
    double limit = 0;
    std::string shard, addressing, accuracy = "watertight", assume;
    bool no_specialize = false, statistics = false;
    bool compare = false, validate = false, list = false, verbose = false, optimize = false, print = false;
    uint32_t recursion = 0, callable_depth = 0, repeats = 1, budget = 0, rounds = 0, timeout = 120;
    int resumable = -1, fetch = -1;
    Tolerance tolerance;
};

std::pair<std::string, std::string> split(const std::string& text, char at, const char* option) {
    size_t found = text.find(at);
    if (found == std::string::npos || found == 0)
        throw Error(std::string(option) + " '" + text + "': NAME=VALUE was expected");
    return {text.substr(0, found), text.substr(found + 1)};
}

std::vector<std::string> split_all(const std::string& text, char at) {
    std::vector<std::string> parts;
    size_t from = 0;
    for (size_t found; (found = text.find(at, from)) != std::string::npos; from = found + 1)
        parts.push_back(text.substr(from, found - from));
    parts.push_back(text.substr(from));
    return parts;
}

// "file:PATH", "pattern:NAME[,WxHxD]", "json:{..}", "@FILE.json", "u32:1,2,3", or JSON as it stands.
Json value_spec(const std::string& text) {
    try {
        if (text.rfind("file:", 0) == 0) return {{"file", text.substr(5)}};
        if (text.rfind("json:", 0) == 0) return Json::parse(text.substr(5));
        if (text.rfind("@", 0) == 0)
            return read_json(text.substr(1));
        if (text.rfind("scene:", 0) == 0) return {{"scene", text.substr(6)}};
        if (text.rfind("pattern:", 0) == 0) {
            auto parts = split_all(text.substr(8), ',');
            Json out{{"pattern", parts[0]}};
            if (parts.size() > 1) {
                Json size = Json::array();
                for (const std::string& n : split_all(parts[1], 'x')) size.push_back(std::stoul(n));
                out["size"] = size;
            }
            return out;
        }
        for (const char* type : {"u8", "i8", "u16", "i16", "u32", "i32", "u64", "i64", "f16", "f32", "f64"})
            if (text.rfind(std::string(type) + ":", 0) == 0) {
                Json values = Json::array();
                for (const std::string& n : split_all(text.substr(std::string(type).size() + 1), ','))
                    values.push_back(n);
                return {{type, values}};
            }
        return Json::parse(text);
    } catch (const Json::exception&) {
        throw Error("cannot read the value '" + text +
                    "'; write file:PATH, pattern:NAME[,WxHxD], scene:NAME, u32:1,2,3 (also f32, i32, ...), "
                    "@FILE.json "
                    "or JSON");
    } catch (const std::logic_error&) {
        throw Error("cannot read a number in '" + text + "'");
    }
}

Job job_of(const CommandLine& c) {
    Job job;
    if (!c.case_file.empty()) {
        job = load_case(c.case_file);
    } else {
        if (c.stages.empty()) throw Error("no stages: give .rgen .rmiss .rchit ... files, --case or --suite");
        job.name = std::filesystem::path(c.stages[0]).stem().string();
    }
    for (const std::string& stage : c.stages) job.sources.push_back(stage_from_file(stage));
    Json groups = job.groups.is_array() ? job.groups : Json::array();
    for (const std::string& text : c.hit_groups) {  // NAME=a.rchit[,b.rahit][,c.rint]
        auto [name, files] = split(text, '=', "--hit-group");
        Json group{{"name", name}};
        for (const std::string& file : split_all(files, ',')) {
            StageSource source = stage_from_file(file);
            size_t index = job.sources.size();
            for (size_t i = 0; i < job.sources.size(); ++i)
                if (job.sources[i].file == source.file) index = i;
            const char* key = source.stage == tools::JobStage::ClosestHit     ? "closest"
                              : source.stage == tools::JobStage::AnyHit       ? "any"
                              : source.stage == tools::JobStage::Intersection ? "intersection"
                                                                              : nullptr;
            if (!key) throw Error("--hit-group " + name + ": " + file + " is no hit stage");
            group[key] = index;
            if (index == job.sources.size()) job.sources.push_back(std::move(source));
        }
        groups.push_back(group);
    }
    if (!groups.empty()) job.groups = groups;
    // Files may share a name; stages may not.
    std::map<std::string, int> seen;
    for (StageSource& source : job.sources)
        if (int n = seen[source.name]++) source.name += "#" + std::to_string(n + 1);
    for (StageSource& source : job.sources)
        source.defines.insert(source.defines.end(), c.defines.begin(), c.defines.end());
    job.include_dirs.insert(job.include_dirs.end(), c.include_dirs.begin(), c.include_dirs.end());
    if (!c.scene.empty()) {
        job.world = load_scene(c.scene);
        job.has_scene = true;
    } else if (c.case_file.empty()) {
        job.world = default_scene();
    }
    if (!c.size.empty()) {
        auto parts = split_all(c.size, 'x');
        uint32_t* const extents[] = {&job.width, &job.height, &job.depth};
        job.width = job.height = job.depth = 1;
        const bool known = parts.size() <= 3;
        for (size_t i = 0; known && i < parts.size(); ++i) {
            const bool number = !parts[i].empty() && parts[i].size() <= 9 &&
                                parts[i].find_first_not_of("0123456789") == std::string::npos;
            *extents[i] = number ? uint32_t(std::stoul(parts[i])) : 0;
        }
        if (!known || !job.width || !job.height || !job.depth)
            throw Error("--size '" + c.size + "': WIDTHxHEIGHT[xDEPTH] was expected, each at least 1");
    } else if (c.case_file.empty()) {
        job.width = job.height = 256;
    }
    for (const std::string& text : c.binds) {
        auto [slot, value] = split(text, '=', "--bind");
        parse_slot(slot);
        job.bindings[slot] = value_spec(value);
    }
    for (const std::string& text : c.specs) {
        auto [id, value] = split(text, '=', "--spec");
        Json parsed = Json::parse(value, nullptr, false);
        job.constants[id] = parsed.is_discarded() ? Json(value) : parsed;
    }
    if (!c.push.empty()) job.push = value_spec(c.push);
    if (!c.table.empty()) job.table = value_spec(c.table);
    if (c.recursion) job.recursion = c.recursion;
    if (c.callable_depth) job.callable_depth = c.callable_depth;
    return job;
}

Backend backend_of(const std::string& kind) {
    if (kind == "khr") return Backend::Khr;
    if (kind == "nv") return Backend::Nv;
    throw Error("--native is khr or nv, not '" + kind + "'");
}

std::string path_of(const std::string& output) {
    const size_t equals = output.find('=');
    return equals != std::string::npos && output.find('.') < equals ? output.substr(equals + 1) : output;
}

// Before the work rather than after it.
void check_outputs(const CommandLine& c) {
    for (const std::string& output : c.outputs) {
        const std::string path = path_of(output);
        bool known = false;
        for (const char* extension : {".png", ".exr", ".pfm", ".bin", ".json"})
            known = known || path.ends_with(extension);
        if (!known)
            throw Error("'" + path + "': outputs are written as .png, .exr or .pfm (images), .bin or .json");
        tools::require_writable(path);
    }
}

void write_outputs(const CommandLine& c, const RunResult& result) {
    for (const std::string& text : c.outputs) {
        size_t equals = text.find('=');
        const Output* chosen = nullptr;
        std::string path = text;
        if (equals != std::string::npos && text.find('.') < equals) {
            Slot slot = parse_slot(text.substr(0, equals));
            path = text.substr(equals + 1);
            for (const Output& output : result.outputs)
                if (output.slot == slot && !chosen) chosen = &output;
            if (!chosen) throw Error("no shader writes binding " + slot_name(slot));
        } else {  // the first image for a picture, else the first of anything
            bool picture = path.ends_with(".png") || path.ends_with(".exr") || path.ends_with(".pfm");
            for (const Output& output : result.outputs)
                if (!chosen || (picture && output.is_image && !chosen->is_image)) chosen = &output;
            if (!chosen)
                throw Error("no shader writes an image or a buffer; there is nothing for '" + path + "'");
        }
        write_output(*chosen, path);
        std::printf("wrote %s: %s\n", path.c_str(), output_title(*chosen).c_str());
    }
}

void print_timing(const char* who, const Job& job, const RunResult& result) {
    double rays = double(job.width) * job.height * job.depth;
    std::printf("%s: pipeline %.3f s, trace %.3f ms (%.2f M invocations/s)\n", who, result.create_seconds,
                result.device_seconds * 1e3,
                result.device_seconds > 0 ? rays / result.device_seconds * 1e-6 : 0.0);
    if (!result.launch_error.empty()) std::printf("%s: launch error %s\n", who, result.launch_error.c_str());
}

int run(const CommandLine& c) {
    Host::Options host_options{c.device, c.validate, true, c.statistics};
    RtcOptions rtc;
    rtc.optimize = c.optimize;
    rtc.resumable = c.resumable;
    rtc.step_budget = c.budget;
    rtc.rounds = c.rounds;
    rtc.fetch = c.fetch;
    rtc.addressing = tools::addressing_from_name(c.addressing);
    rtc.accuracy = c.accuracy;
    rtc.assume = c.assume;
    rtc.specialize = !c.no_specialize;
    rtc.statistics = c.statistics;
    rtc.save_module = c.save;
    if (!c.suite.empty()) {
        SuiteOptions suite;
        suite.folder = c.suite;
        suite.filter = c.filter;
        suite.json = c.json;
        if (!c.variants.empty()) suite.variants = c.variants;
        for (const std::string& variant : suite.variants) variant_of(variant);
        suite.host = host_options;
        suite.rtc = rtc;
        suite.list = c.list;
        suite.verbose = c.verbose;
        suite.compare = c.compare;
        suite.timeout_seconds = c.timeout;
        suite.limit_seconds = c.limit;
        if (!c.shard.empty()) {
            unsigned index = 0, count = 0;
            if (std::sscanf(c.shard.c_str(), "%u/%u", &index, &count) != 2 || !count || index >= count)
                throw Error("--shard '" + c.shard + "': INDEX/COUNT was expected, INDEX below COUNT");
            suite.shard = index;
            suite.shards = count;
        }
        suite.oracle = c.oracle;
        suite.save_oracle = c.save_oracle;
        return run_suite(suite);
    }
    Job job = job_of(c);
    check_outputs(c);
    std::set<Backend> backends;
    Backend native_backend = c.native_kind.empty() ? Backend::Khr : backend_of(c.native_kind);
    if (c.compare || c.native_kind.empty()) backends.insert(Backend::Rtc);
    if (c.compare || !c.native_kind.empty()) backends.insert(native_backend);
    Host host(backends, host_options);
    Dialect native_dialect = native_backend == Backend::Khr ? Dialect::Ext : Dialect::AsWritten;

    RunResult ours, theirs;
    bool ran_ours = backends.count(Backend::Rtc);
    int status = 0;
    if (ran_ours) {
        compile(job, Dialect::AsWritten);
        ours = host.run(Backend::Rtc, job, rtc, c.repeats);
        print_timing("rtc", job, ours);
        if (!ours.launch_error.empty()) status = 1;
    }
    if (c.compare || !ran_ours) {
        compile(job, native_dialect);
        theirs = host.run(native_backend, job, rtc, c.repeats);
        print_timing(native_backend == Backend::Khr ? "native KHR" : "native NV", job, theirs);
    }
    const RunResult& shown = ran_ours ? ours : theirs;
    if (c.compare) {
        for (const Difference& d : compare(ours, theirs, c.tolerance)) {
            std::printf("%s: %zu of %zu differ (%.4f %%), largest difference %g%s\n", d.output.c_str(),
                        d.differing, d.items, d.items ? 100.0 * double(d.differing) / double(d.items) : 0.0,
                        d.largest, d.acceptable ? "" : ": too many");
            for (const std::string& example : d.examples) std::printf("  %s\n", example.c_str());
            if (!d.acceptable) status = 1;
        }
    }
    if (!job.expectations.empty())
        for (const CellResult& cell : check_expectations(job, shown, c.compare ? &theirs : nullptr)) {
            std::printf("%s %s%s%s\n", cell.passed ? "pass" : "FAIL", cell.cell.c_str(),
                        cell.detail.empty() ? "" : ": ", cell.detail.c_str());
            if (!cell.passed) status = 1;
        }
    write_outputs(c, shown);
    if (c.print || (c.outputs.empty() && job.expectations.empty() && !c.compare))
        for (const Output& output : shown.outputs) {
            std::printf("%s\n", output_title(output).c_str());
            if (!c.print || !output.block) continue;
            std::string text = read_typed(*output.block, output.bytes.data(), output.bytes.size()).dump();
            std::printf("  %s\n",
                        text.size() > 4000 ? (text.substr(0, 4000) + " ...").c_str() : text.c_str());
        }
    host.context().require_silent_validation();
    return status;
}

}  // namespace
}  // namespace rtc::run

int main(int argc, char** argv) {
    rtc::run::CommandLine c;
    CLI::App app{
        "rtc-run: run any ray tracing pipeline, by rtc or by the device's own ray tracing.\n"
        "Scene, bindings and case files are described in docs/rtc-run.md."};
    app.add_option("stages", c.stages, "GLSL (.rgen .rint .rahit .rchit .rmiss .rcall) or SPIR-V (.spv)");
    app.add_option("--hit-group", c.hit_groups, "NAME=a.rchit[,b.rahit][,c.rint]")->take_all();
    app.add_option("--scene", c.scene, "scene: .json .gltf .glb .obj .ply or builtin:NAME");
    app.add_option("--size", c.size, "WIDTHxHEIGHT[xDEPTH] of the launch (256x256)");
    app.add_option("--bind", c.binds,
                   "SET.BINDING=file:PATH | pattern:NAME[,WxH] | scene:NAME | u32:1,2,.. | @FILE.json | JSON")
        ->take_all();
    app.add_option("--push", c.push, "push constants, as for --bind");
    app.add_option("--spec", c.specs, "ID=VALUE or NAME=VALUE: specialisation constant")->take_all();
    app.add_option("--table", c.table, "shader binding table, JSON or @FILE.json");
    app.add_option("-D", c.defines, "NAME[=VALUE]: macro")->take_all();
    app.add_option("-I", c.include_dirs, "folder for #include")->take_all();
    app.add_option("--max-recursion-depth", c.recursion, "trace calls nested in trace calls");
    app.add_option("--max-callable-depth", c.callable_depth, "callables nested in callables");
    app.add_option("--native", c.native_kind, "nv or khr: run on the device's own extension");
    app.add_flag("--compare", c.compare,
                 "run rtc and native, report differences; status 1 beyond the tolerance");
    app.add_option("--tolerance", c.tolerance.relative,
                   "relative difference of floats that is no difference (1e-3)");
    app.add_option("--allow", c.tolerance.allowed, "fraction of texels or words that may differ (0)");
    app.add_option("--device", c.device, "index, or part of the name");
    app.add_option("-o,--output", c.outputs, "FILE or SET.BINDING=FILE; .png .exr .pfm .bin .json")
        ->take_all();
    app.add_flag("--print", c.print, "print the buffers that shaders wrote");
    app.add_option("--repeat", c.repeats, "trace so many times and report the fastest");
    app.add_flag("-O", c.optimize, "let rtc optimise the module");
    app.add_option("--resumable", c.resumable,
                   "0 or 1: compile lanes that can suspend (default: as the device needs)");
    app.add_option("--addressing", c.addressing,
                   "acceleration structures in a heap or by address (default: as the device recommends)")
        ->check(CLI::IsMember({"heap", "address"}));
    app.add_option("--assume", c.assume, "promises about the scene, as rtc takes them");
    app.add_flag("--no-specialize", c.no_specialize, "remove nothing for what is known, as rtc --no-specialize");
    app.add_flag("--statistics", c.statistics, "print what the driver tells of rtc's pipeline: registers, spills, code size");
    app.add_option("--accuracy", c.accuracy, "the traversal that is linked (watertight)")
        ->check(CLI::IsMember({"fast", "watertight", "exact", "exact64"}));
    app.add_option("--fetch", c.fetch, "a heap through 0 texels, 1 a storage buffer");
    app.add_option("--step-budget", c.budget, "loop turns before a lane suspends");
    app.add_option("--rounds", c.rounds, "how often suspended lanes may go on (64)")->check(CLI::Range(1, 16384));
    app.add_option("--save-module", c.save, "write the module rtc linked");
    app.add_flag("--validate", c.validate, "run under the Khronos validation layer");
    app.add_option("--case", c.case_file, "a case file: stages, scene, bindings and expected values");
    app.add_option("--suite", c.suite, "run all case files of a folder");
    app.add_option("--filter", c.filter, "of the suite, only names that contain this");
    app.add_option("--on", c.variants, "variants of the suite: rtc-nv rtc-ext khr nv")->delimiter(',');
    app.add_option("--json", c.json, "write the suite's results there");
    app.add_option("--timeout", c.timeout, "seconds for one case of the suite (120)");
    app.add_option("--limit", c.limit, "seconds for the whole suite; cases that are left then are skipped");
    app.add_option("--shard", c.shard, "I/N: of the suite, every Nth case from the Ith on");
    app.add_option("--oracle", c.oracle, "folder of recorded native outputs for cases without values");
    app.add_option("--save-oracle", c.save_oracle, "record native outputs there");
    app.add_flag("--list", c.list, "list the suite's cases");
    app.add_flag("-v,--verbose", c.verbose, "print cases that pass, and warnings");
    if (const int status = rtc::tools::parse_command_line(app, "rtc-run", argc, argv); status >= 0) return status;
    return rtc::tools::run_program("rtc-run", [&] { return rtc::run::run(c); });
}
