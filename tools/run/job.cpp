#include "job.h"

#include <algorithm>
#include <filesystem>

#include "files.h"

namespace rtc::run {

using tools::Error;
using tools::JobGroup;
using tools::JobStage;

Slot parse_slot(const std::string& text) {
    size_t dot = text.find('.');
    try {
        if (dot == std::string::npos || dot == 0 || dot + 1 == text.size()) throw std::invalid_argument("");
        return {uint32_t(std::stoul(text.substr(0, dot))), uint32_t(std::stoul(text.substr(dot + 1)))};
    } catch (const std::logic_error&) {
        throw Error("'" + text + "' is no binding; write SET.BINDING, as in 0.1");
    }
}

std::string slot_name(Slot slot) { return std::to_string(slot.set) + "." + std::to_string(slot.binding); }

StageSource stage_from_file(const std::string& path) {
    StageSource source;
    source.file = path;
    source.name = std::filesystem::path(path).filename().string();
    bool known = native::stage_of_file(path, source.stage);
    if (path.ends_with(".spv"))
        source.words = native::read_words(path);
    else {
        source.text = native::read_text(path);
        if (!known)
            throw Error("cannot tell the stage of '" + path +
                        "'; its name must end in .rgen .rint .rahit .rchit .rmiss "
                        "or .rcall (with .glsl behind if you like), or it must be .spv");
    }
    return source;
}

namespace {

std::string text_or(const Json& json, const char* key, const std::string& otherwise) {
    return json.contains(key) ? json[key].get<std::string>() : otherwise;
}

std::string join_lines(const Json& json) {  // a text, or a list of lines
    if (json.is_string()) return json.get<std::string>();
    std::string text;
    for (const Json& line : json) text += line.get<std::string>() + "\n";
    return text;
}

}  // namespace

Job parse_case(const Json& json, const std::string& file) {
    static const std::set<std::string> known = {
        "name", "section", "stages",         "groups",       "table",   "scene",
        "size", "push",    "bindings",       "expect",       "spec",    "recursion",
        "only", "skip",    "callable-depth", "launch-error", "include", "about",
        "addressing", "assume"};
    if (!json.is_object()) throw Error(file + ": a case is a JSON object");
    for (const auto& [key, value] : json.items())
        if (!known.count(key)) throw Error(file + ": unknown key '" + key + "' in a case");
    std::string folder = std::filesystem::path(file).parent_path().string();
    Job job;
    job.file = file;
    job.name = text_or(json, "name", std::filesystem::path(file).stem().string());
    job.section = text_or(json, "section", "");
    for (const Json& stage : json.at("stages")) {
        StageSource source;
        if (stage.is_string()) {
            source = stage_from_file((std::filesystem::path(folder) / stage.get<std::string>()).string());
        } else {
            if (stage.contains("file"))
                source = stage_from_file(
                    (std::filesystem::path(folder) / stage["file"].get<std::string>()).string());
            if (stage.contains("source")) source.text = join_lines(stage["source"]);
            if (stage.contains("stage") &&
                !native::stage_of_suffix(stage["stage"].get<std::string>(), source.stage))
                throw Error("stage " + stage["stage"].dump() +
                            " is none of rgen rint rahit rchit rmiss rcall");
            source.name =
                text_or(stage, "name", source.name.empty() ? text_or(stage, "stage", "") : source.name);
            if (source.file.empty())
                source.file = job.name + "/" + source.name + "." + native::stage_suffix(source.stage);
            source.entry = text_or(stage, "entry", "");
            for (const Json& define : stage.value("defines", Json::array()))
                source.defines.push_back(define.get<std::string>());
            if (stage.contains("spec"))
                for (const auto& [id, value] : stage["spec"].items()) source.constants[id] = value;
        }
        job.sources.push_back(std::move(source));
    }
    for (const Json& dir : json.value("include", Json::array()))
        job.include_dirs.push_back((std::filesystem::path(folder) / dir.get<std::string>()).string());
    job.groups = json.value("groups", Json());
    job.table = json.value("table", Json());
    job.bindings = json.value("bindings", Json::object());
    job.push = json.value("push", Json());
    job.constants = json.value("spec", Json::object());
    if (json.contains("scene")) {
        job.world = parse_scene(json["scene"], folder);
        job.has_scene = true;
    } else {
        job.world = default_scene();
    }
    if (json.contains("size")) {
        const Json& size = json["size"];
        job.sized = true;
        job.width = size.at(0).get<uint32_t>();
        job.height = size.size() > 1 ? size[1].get<uint32_t>() : 1;
        job.depth = size.size() > 2 ? size[2].get<uint32_t>() : 1;
    }
    job.recursion = json.value("recursion", 0u);
    job.callable_depth = json.value("callable-depth", 0u);
    job.launch_error = text_or(json, "launch-error", "");
    job.addressing = text_or(json, "addressing", "");
    job.assume = text_or(json, "assume", "");
    for (const Json& item : json.value("only", Json::array())) job.only.insert(item.get<std::string>());
    const Json skips = json.value("skip", Json::object());
    for (const auto& [backend, reason] : skips.items()) job.skip[backend] = reason.get<std::string>();
    for (const Json& expect : json.value("expect", Json::array())) {
        Expectation e;
        e.cell = text_or(expect, "cell", job.name);
        e.slot = parse_slot(text_or(expect, "binding", "0.1"));
        e.type = text_or(expect, "type", "u32");
        e.at = expect.value("at", size_t(0));
        e.values = expect.value("values", Json());
        e.absolute = expect.value("abs", 0.0);
        e.relative = expect.value("rel", 0.0);
        e.native = text_or(expect, "native", "");
        job.expectations.push_back(std::move(e));
    }
    return job;
}

Job load_case(const std::string& file) {
    try {
        return parse_case(read_json(file), file);
    } catch (const Json::exception& e) {
        throw Error(file + ": " + problem_of(e));
    }
}

namespace {

int stage_index(const Job& job, const Json& name, const char* what) {
    if (name.is_null()) return -1;
    if (name.is_number()) {
        if (name.get<size_t>() >= job.sources.size())
            throw Error(std::string(what) + ": there is no stage " + name.dump());
        return name.get<int>();
    }
    for (size_t i = 0; i < job.sources.size(); ++i)
        if (job.sources[i].name == name.get<std::string>()) return int(i);
    std::string all;
    for (const auto& source : job.sources) all += " " + source.name;
    throw Error(std::string(what) + ": there is no stage " + name.dump() + "; there are:" + all);
}

void make_groups(Job& job) {
    auto& groups = job.pipeline.groups;
    groups.clear();
    std::set<int> in_group;
    if (job.groups.is_array())
        for (const Json& json : job.groups) {
            JobGroup group;
            group.general = stage_index(job, json.value("general", Json()), "group");
            group.closest_hit = stage_index(job, json.value("closest", Json()), "group");
            group.any_hit = stage_index(job, json.value("any", Json()), "group");
            group.intersection = stage_index(job, json.value("intersection", Json()), "group");
            group.name = text_or(json, "name",
                                 group.general >= 0 ? job.sources[size_t(group.general)].name
                                                    : "group" + std::to_string(groups.size()));
            for (int s : {group.general, group.closest_hit, group.any_hit, group.intersection})
                in_group.insert(s);
            groups.push_back(group);
        }
    // Stages that no group names: general ones and closest-hits are groups of their own; an any-hit or an
    // intersection shader joins the only closest-hit that is free.
    JobGroup loose;
    int closest = 0;
    for (size_t i = 0; i < job.sources.size(); ++i) {
        if (in_group.count(int(i))) continue;
        switch (job.sources[i].stage) {
            case JobStage::RayGen:
            case JobStage::Miss:
            case JobStage::Callable: {
                JobGroup group;
                group.name = job.sources[i].name;
                group.general = int(i);
                groups.push_back(group);
                break;
            }
            case JobStage::ClosestHit:
                ++closest;
                break;
            case JobStage::AnyHit:
                loose.any_hit = int(i);
                break;
            case JobStage::Intersection:
                loose.intersection = int(i);
                break;
        }
    }
    if (closest > 1 && (loose.any_hit >= 0 || loose.intersection >= 0))
        throw Error(
            "several closest-hit stages and a free any-hit or intersection stage: say who belongs together "
            "with --hit-group");
    bool made = false;
    for (size_t i = 0; i < job.sources.size(); ++i)
        if (!in_group.count(int(i)) && job.sources[i].stage == JobStage::ClosestHit) {
            JobGroup group = loose;
            group.closest_hit = int(i);
            group.name = job.sources[i].name;
            groups.push_back(group);
            made = true;
        }
    if (!made && (loose.any_hit >= 0 || loose.intersection >= 0)) {
        loose.name = "hit";
        groups.push_back(loose);
    }
}

void specialize(const Job& job, const StageSource& source, const Module& module, tools::JobShader& shader) {
    auto apply = [&](const std::string& key, const Json& value, bool must) {
        for (const SpecConstant& constant : module.constants)
            if (key == std::to_string(constant.id) || key == constant.name) {
                shader.constants.push_back(
                    {constant.id, number_bits(value, constant.kind, constant.width), constant.width / 8});
                return;
            }
        if (must) throw Error("stage " + source.name + " has no specialisation constant '" + key + "'");
    };
    for (const auto& [key, value] : source.constants) apply(key, value, true);
    for (const auto& [key, value] : job.constants.items())
        if (!source.constants.count(key)) apply(key, value, false);
}

}  // namespace

void compile(Job& job, Dialect dialect, bool debug_info) {
    job.pipeline = {};
    job.modules.clear();
    bool hit_traces = false;
    for (const StageSource& source : job.sources) {
        tools::JobShader shader;
        shader.stage = source.stage;
        shader.name = source.name;
        shader.file = source.file;
        if (!source.words.empty()) {
            shader.spirv = source.words;
        } else {
            native::GlslSource glsl;
            glsl.text = dialect == Dialect::Ext ? native::to_ext(source.text) : source.text;
            glsl.file = source.file;
            glsl.stage = source.stage;
            glsl.defines = source.defines;
            glsl.include_dirs = job.include_dirs;
            glsl.debug_info = debug_info;
            shader.spirv = native::compile_glsl(glsl);
        }
        Module module = read_module(shader.spirv, source.entry, source.file);
        if (!source.words.empty()) shader.stage = module.stage;
        shader.entry = module.entry;
        specialize(job, source, module, shader);
        hit_traces |= module.traces && module.stage != JobStage::RayGen;
        job.modules.push_back(std::move(module));
        job.pipeline.shaders.push_back(std::move(shader));
    }
    for (const auto& [key, value] : job.constants.items()) {
        bool known = false;
        for (const Module& module : job.modules)
            for (const SpecConstant& constant : module.constants)
                known = known || key == std::to_string(constant.id) || key == constant.name;
        if (!known) throw Error("no stage has a specialisation constant '" + key + "'");
    }
    for (size_t i = 0; i < job.sources.size(); ++i) job.sources[i].stage = job.pipeline.shaders[i].stage;
    make_groups(job);
    // A shader that a trace called and that traces itself may recurse: give it some levels.
    job.pipeline.max_recursion = job.recursion ? job.recursion : hit_traces ? 4 : 1;
    job.pipeline.max_callable_depth = job.callable_depth;
}

native::Tables make_tables(const Job& job, const AddressOf& address) {
    const auto& groups = job.pipeline.groups;
    auto group_index = [&](const Json& name) -> uint32_t {
        if (name.is_null()) return ~0u;
        if (name.is_number()) {
            if (name.get<size_t>() >= groups.size()) throw Error("record: there is no group " + name.dump());
            return name.get<uint32_t>();
        }
        for (size_t i = 0; i < groups.size(); ++i)
            if (groups[i].name == name.get<std::string>()) return uint32_t(i);
        std::string all;
        for (const auto& group : groups) all += " " + group.name;
        throw Error("record: there is no group " + name.dump() + "; there are:" + all);
    };
    native::Tables tables;
    // Without a table, every group gets one record, in the order of the groups.
    for (size_t i = 0; i < groups.size(); ++i) {
        tools::JobRecord record;
        record.group = uint32_t(i);
        native::Table* table = &tables.hit;
        if (groups[i].general >= 0) switch (job.sources[size_t(groups[i].general)].stage) {
                case JobStage::RayGen:
                    table = &tables.raygen;
                    break;
                case JobStage::Miss:
                    table = &tables.miss;
                    break;
                default:
                    table = &tables.callable;
                    break;
            }
        table->records.push_back(record);
    }
    if (!job.table.is_object()) return tables;
    auto read = [&](const char* key, native::Table& table) {
        if (!job.table.contains(key)) return;
        table.records.clear();
        for (const Json& json : job.table[key]) {
            tools::JobRecord record;
            if (json.is_object()) {
                record.group = group_index(json.value("group", Json()));
                if (json.contains("data")) {
                    const Json& data = json["data"];
                    TypeRef block;  // the record block of the group's stages
                    if (record.group != ~0u) {
                        const JobGroup& group = groups[record.group];
                        for (int s : {group.general, group.closest_hit, group.any_hit, group.intersection})
                            if (s >= 0 && job.modules[size_t(s)].record)
                                block = job.modules[size_t(s)].record;
                    }
                    if (!raw_bytes(data, block ? block->size() : 0, address, record.data)) {
                        if (record.group == ~0u) throw Error("a null record can only hold raw data");
                        if (!block)
                            throw Error("no stage of group " + groups[record.group].name +
                                        " declares a shader record");
                        record.data.resize(block->size());
                        write_typed(*block, data, record.data, 0, address);
                    }
                }
            } else {
                record.group = group_index(json);
            }
            table.records.push_back(std::move(record));
        }
        table.stride = job.table.value(std::string(key) + "-stride", 0u);
    };
    read("raygen", tables.raygen);
    read("miss", tables.miss);
    read("hit", tables.hit);
    read("callable", tables.callable);
    tables.raygen_index = job.table.value("raygen-index", 0u);
    return tables;
}

}  // namespace rtc::run
