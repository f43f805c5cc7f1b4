// Reflection as JSON and back. The keys are listed in reflection_io.h;
// keys keep the order written here, so that equal pipelines give equal bytes.
#include <nlohmann/json.hpp>

#include <array>
#include <cstdio>

#include "reflect/json_writer.h"
#include "reflect/reflection_io.h"
#include "rtc/abi.h"

namespace rtc {
namespace {

using Json = nlohmann::json;

constexpr std::array kStageNames = {"rgen", "rint", "rahit", "rchit", "rmiss", "rcall"};
constexpr std::array kAccuracies = {"watertight", "fast", "exact", "exact64"};
constexpr std::array kGroupNames = {"general", "triangles", "procedural"};

struct Named {
    const char* name;
    uint32_t value;
};

constexpr std::array kBindings = {
    Named{"params", RTC_BINDING_PARAMS},
    Named{"heapTexels", RTC_BINDING_HEAP_TEXELS},
    Named{"heap", RTC_BINDING_HEAP},
    Named{"sbtRaygen", RTC_BINDING_SBT_RAYGEN},
    Named{"sbtMiss", RTC_BINDING_SBT_MISS},
    Named{"sbtHit", RTC_BINDING_SBT_HIT},
    Named{"sbtCallable", RTC_BINDING_SBT_CALLABLE},
    Named{"control", RTC_BINDING_CONTROL},
    Named{"scratch", RTC_BINDING_SCRATCH},
};
static_assert(kBindings.size() == RTC_BINDING_COUNT);

constexpr std::array kFlags = {Named{"resumable", RTC_MODULE_RESUMABLE},
                               Named{"addressMode", RTC_MODULE_ADDRESS_MODE},
                               Named{"checked", RTC_MODULE_CHECKED}};

// At least eight digits.
std::string hex(uint64_t value) {
    char digits[16];
    const char* const end = std::to_chars(digits, digits + sizeof digits, value, 16).ptr;
    const size_t count = static_cast<size_t>(end - digits);
    std::string text = "0x";
    if (count < 8) text.append(8 - count, '0');
    return text.append(digits, count);
}

uint64_t from_hex(const Json& json) { return std::stoull(json.get<std::string>(), nullptr, 16); }

template <typename Names>
uint32_t index_of(const Names& names, const std::string& name) {
    for (size_t i = 0; i < names.size(); ++i)
        if (name == names[i]) return static_cast<uint32_t>(i);
    throw std::runtime_error("unknown name '" + name + "'");
}

std::string spirv_version_text(uint32_t version) {
    return std::to_string(version >> 16 & 0xff) + "." + std::to_string(version >> 8 & 0xff);
}

uint32_t spirv_version_from(const std::string& text) {
    unsigned major = 0, minor = 0;
    if (std::sscanf(text.c_str(), "%u.%u", &major, &minor) != 2)
        throw std::runtime_error("bad SPIR-V version '" + text + "'");
    return (major & 0xff) << 16 | (minor & 0xff) << 8;
}

void write(JsonWriter& out, const StageReport& stage) {
    out.member("name", stage.name);
    out.member("kind", kStageNames.at(static_cast<size_t>(stage.kind)));
    out.member("file", stage.file);
    out.member("firstState", stage.first_state);
    out.member("states", stage.states);
    out.member("payloadWords", stage.payload_words);
    out.member("recordBytes", stage.record_bytes);
}

void write(JsonWriter& out, const GroupReport& group) {
    out.member("name", group.name);
    out.member("kind", kGroupNames.at(static_cast<size_t>(group.kind)));
    out.key("handle");
    out.begin_array();
    for (uint32_t word : group.handle) out.value(hex(word));
    out.end_array();
}

void write(JsonWriter& out, const ResourceReport& resource) {
    out.member("name", resource.name);
    out.member("stage", resource.stage);
    out.member("set", resource.set);
    out.member("binding", resource.binding);
    out.member("type", resource.type);
    out.member("arraySize", resource.array_size);
}

void write(JsonWriter& out, const SpecConstantReport& constant) {
    out.member("stage", constant.stage);
    out.member("name", constant.name);
    out.member("originalId", constant.original_id);
    out.member("id", constant.id);
    out.member("type", constant.type);
    out.member("default", hex(constant.default_value));
}

void write(JsonWriter& out, const TraceSiteReport& site) {
    out.member("stage", site.stage);
    out.member("file", site.file);
    out.member("line", site.line);
    out.member("call", site.callable ? "callable" : "trace");
    out.member("frameBytes", site.frame_bytes);
    out.member("variables", site.variables);
}

void write(JsonWriter& out, const FactReport& fact) {
    out.member("name", fact.name);
    out.member("state", fact.state);
    out.member("detail", fact.detail);
}

template <typename T>
void write_list(JsonWriter& out, const char* name, const std::vector<T>& items) {
    out.key(name);
    out.begin_array();
    for (const T& item : items) {
        out.begin_object();
        write(out, item);
        out.end_object();
    }
    out.end_array();
}

std::string to_json(const Reflection& r, bool pretty) {
    JsonWriter out(pretty);
    out.begin_object();
    out.member("abiVersion", RTC_ABI_VERSION);
    out.member("identity", hex(r.identity));
    out.key("flags");
    out.begin_array();
    for (const Named& flag : kFlags)
        if (r.flags & flag.value) out.value(flag.name);
    out.end_array();
    out.member("spirvVersion", spirv_version_text(r.spirv_version));
    out.member("instructions", r.instruction_count);
    out.member("states", r.state_count);
    out.member("accuracy", accuracy_name(r.accuracy));
    out.member("maxRecursionDepth", r.max_recursion_depth);
    out.member("maxCallableDepth", r.max_callable_depth);
    out.member("stackWords", r.stack_words);
    out.member("scratchWords", r.scratch_words);
    out.member("payloadWords", r.payload_words);
    out.member("attributeWords", r.attribute_words);
    out.member("callableWords", r.callable_words);
    out.member("pushConstantBytes", r.push_constant_bytes);
    out.key("reserved");
    out.begin_object();
    out.member("set", r.reserved_set);
    out.member("binding", r.reserved_binding);
    out.key("bindings");
    out.begin_array();
    for (const Named& binding : kBindings) {
        if (!(r.used_bindings >> binding.value & 1)) continue;
        out.begin_object();
        out.member("name", binding.name);
        out.member("binding", r.reserved_binding + binding.value);
        out.end_object();
    }
    out.end_array();
    out.end_object();
    out.member("requiredFeatures", r.required_features);
    write_list(out, "stages", r.stages);
    write_list(out, "groups", r.groups);
    write_list(out, "resources", r.resources);
    write_list(out, "specConstants", r.spec_constants);
    write_list(out, "traceSites", r.trace_sites);
    out.member("assumptions", assumption_names(r.assumptions));
    write_list(out, "facts", r.facts);
    out.end_object();
    return out.take();
}

Reflection from_json(const Json& json) {
    Reflection r;
    const uint32_t abi = json.at("abiVersion").get<uint32_t>();
    if (abi != RTC_ABI_VERSION)
        throw std::runtime_error("ABI version " + std::to_string(abi) + ", this rtc has " +
                                 std::to_string(RTC_ABI_VERSION));
    r.identity = static_cast<uint32_t>(from_hex(json.at("identity")));
    for (const Json& name : json.at("flags"))
        for (const Named& flag : kFlags)
            if (name.get<std::string>() == flag.name) r.flags |= flag.value;
    r.spirv_version = spirv_version_from(json.at("spirvVersion").get<std::string>());
    json.at("instructions").get_to(r.instruction_count);
    json.at("states").get_to(r.state_count);
    // Modules linked before there was a choice are watertight.
    if (json.contains("accuracy"))
        r.accuracy = static_cast<Accuracy>(index_of(kAccuracies, json.at("accuracy").get<std::string>()));
    json.at("maxRecursionDepth").get_to(r.max_recursion_depth);
    json.at("maxCallableDepth").get_to(r.max_callable_depth);
    json.at("stackWords").get_to(r.stack_words);
    json.at("scratchWords").get_to(r.scratch_words);
    json.at("payloadWords").get_to(r.payload_words);
    json.at("attributeWords").get_to(r.attribute_words);
    json.at("callableWords").get_to(r.callable_words);
    json.at("pushConstantBytes").get_to(r.push_constant_bytes);
    const Json& reserved = json.at("reserved");
    reserved.at("set").get_to(r.reserved_set);
    reserved.at("binding").get_to(r.reserved_binding);
    for (const Json& used : reserved.at("bindings")) {
        const std::string name = used.at("name").get<std::string>();
        for (const Named& binding : kBindings)
            if (name == binding.name) r.used_bindings |= 1u << binding.value;
    }
    json.at("requiredFeatures").get_to(r.required_features);
    for (const Json& item : json.at("stages")) {
        StageReport& stage = r.stages.emplace_back();
        item.at("name").get_to(stage.name);
        stage.kind = static_cast<StageKind>(index_of(kStageNames, item.at("kind").get<std::string>()));
        item.at("file").get_to(stage.file);
        item.at("firstState").get_to(stage.first_state);
        item.at("states").get_to(stage.states);
        item.at("payloadWords").get_to(stage.payload_words);
        item.at("recordBytes").get_to(stage.record_bytes);
    }
    for (const Json& item : json.at("groups")) {
        GroupReport& group = r.groups.emplace_back();
        item.at("name").get_to(group.name);
        group.kind = static_cast<GroupKind>(index_of(kGroupNames, item.at("kind").get<std::string>()));
        const Json& handle = item.at("handle");
        for (size_t i = 0; i < RTC_HANDLE_WORDS; ++i)
            group.handle[i] = static_cast<uint32_t>(from_hex(handle.at(i)));
    }
    for (const Json& item : json.at("resources")) {
        ResourceReport& resource = r.resources.emplace_back();
        item.at("name").get_to(resource.name);
        item.at("stage").get_to(resource.stage);
        item.at("set").get_to(resource.set);
        item.at("binding").get_to(resource.binding);
        item.at("type").get_to(resource.type);
        item.at("arraySize").get_to(resource.array_size);
    }
    for (const Json& item : json.at("specConstants")) {
        SpecConstantReport& constant = r.spec_constants.emplace_back();
        item.at("stage").get_to(constant.stage);
        item.at("name").get_to(constant.name);
        item.at("originalId").get_to(constant.original_id);
        item.at("id").get_to(constant.id);
        item.at("type").get_to(constant.type);
        constant.default_value = from_hex(item.at("default"));
    }
    for (const Json& item : json.at("traceSites")) {
        TraceSiteReport& site = r.trace_sites.emplace_back();
        item.at("stage").get_to(site.stage);
        item.at("file").get_to(site.file);
        item.at("line").get_to(site.line);
        site.callable = item.at("call").get<std::string>() == "callable";
        item.at("frameBytes").get_to(site.frame_bytes);
        item.at("variables").get_to(site.variables);
    }
    for (const Json& item : json.at("assumptions")) {
        const std::string name = item.get<std::string>();
        uint32_t bit = 0;
        if (!assumption_from_name(name, bit)) throw std::runtime_error("unknown assumption '" + name + "'");
        r.assumptions |= bit;
    }
    for (const Json& item : json.at("facts")) {
        FactReport& fact = r.facts.emplace_back();
        item.at("name").get_to(fact.name);
        item.at("state").get_to(fact.state);
        item.at("detail").get_to(fact.detail);
    }
    return r;
}

std::string last_component(const std::string& path) {
    const size_t slash = path.find_last_of("/\\");
    return slash == std::string::npos ? path : path.substr(slash + 1);
}

}  // namespace

const char* accuracy_name(Accuracy accuracy) { return kAccuracies.at(static_cast<size_t>(accuracy)); }

const char* group_kind_name(GroupKind kind) { return kGroupNames.at(static_cast<size_t>(kind)); }

std::string reflection_to_json(const Reflection& reflection) { return to_json(reflection, true) + "\n"; }

std::string embedded_json(const Reflection& reflection) {
    Reflection placeless = reflection;
    for (StageReport& stage : placeless.stages) stage.file = last_component(stage.file);
    for (TraceSiteReport& site : placeless.trace_sites) site.file = last_component(site.file);
    return to_json(placeless, false);
}

bool reflection_from_json(const std::string& json, Reflection& reflection, std::string& error) {
    try {
        reflection = from_json(Json::parse(json));
        return true;
    } catch (const std::exception& problem) {
        error = std::string("damaged reflection: ") + problem.what();
        return false;
    }
}

}  // namespace rtc
