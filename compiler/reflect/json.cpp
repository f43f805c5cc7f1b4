// Reflection as JSON and back. The keys are listed in reflection_io.h;
// keys keep the order written here, so that equal pipelines give equal bytes.
#include <nlohmann/json.hpp>

#include <array>
#include <cstdio>

#include "reflect/reflection_io.h"
#include "rtc/abi.h"

namespace rtc {
namespace {

using Json = nlohmann::ordered_json;

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

std::string hex(uint64_t value) {
    char text[24];
    std::snprintf(text, sizeof text, "0x%08llx", static_cast<unsigned long long>(value));
    return text;
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

Json stage_json(const StageReport& stage) {
    return {{"name", stage.name},
            {"kind", kStageNames.at(static_cast<size_t>(stage.kind))},
            {"file", stage.file},
            {"firstState", stage.first_state},
            {"states", stage.states},
            {"payloadWords", stage.payload_words},
            {"recordBytes", stage.record_bytes}};
}

Json group_json(const GroupReport& group) {
    Json handle = Json::array();
    for (uint32_t word : group.handle) handle.push_back(hex(word));
    return {{"name", group.name},
            {"kind", kGroupNames.at(static_cast<size_t>(group.kind))},
            {"handle", std::move(handle)}};
}

Json resource_json(const ResourceReport& resource) {
    return {{"name", resource.name},       {"stage", resource.stage}, {"set", resource.set},
            {"binding", resource.binding}, {"type", resource.type},   {"arraySize", resource.array_size}};
}

Json spec_constant_json(const SpecConstantReport& constant) {
    return {{"stage", constant.stage}, {"name", constant.name}, {"originalId", constant.original_id},
            {"id", constant.id},       {"type", constant.type}, {"default", hex(constant.default_value)}};
}

Json trace_site_json(const TraceSiteReport& site) {
    return {{"stage", site.stage},
            {"file", site.file},
            {"line", site.line},
            {"call", site.callable ? "callable" : "trace"},
            {"frameBytes", site.frame_bytes},
            {"variables", site.variables}};
}

Json fact_json(const FactReport& fact) {
    return {{"name", fact.name}, {"state", fact.state}, {"detail", fact.detail}};
}

template <typename T, typename F>
Json list(const std::vector<T>& items, F&& one) {
    Json array = Json::array();
    for (const T& item : items) array.push_back(one(item));
    return array;
}

Json to_json(const Reflection& r) {
    Json flags = Json::array();
    for (const Named& flag : kFlags)
        if (r.flags & flag.value) flags.push_back(flag.name);
    Json bindings = Json::array();
    for (const Named& binding : kBindings)
        if (r.used_bindings >> binding.value & 1)
            bindings.push_back({{"name", binding.name}, {"binding", r.reserved_binding + binding.value}});
    return {
        {"abiVersion", RTC_ABI_VERSION},
        {"identity", hex(r.identity)},
        {"flags", std::move(flags)},
        {"spirvVersion", spirv_version_text(r.spirv_version)},
        {"instructions", r.instruction_count},
        {"states", r.state_count},
        {"accuracy", accuracy_name(r.accuracy)},
        {"maxRecursionDepth", r.max_recursion_depth},
        {"maxCallableDepth", r.max_callable_depth},
        {"stackWords", r.stack_words},
        {"scratchWords", r.scratch_words},
        {"payloadWords", r.payload_words},
        {"attributeWords", r.attribute_words},
        {"callableWords", r.callable_words},
        {"pushConstantBytes", r.push_constant_bytes},
        {"reserved",
         {{"set", r.reserved_set}, {"binding", r.reserved_binding}, {"bindings", std::move(bindings)}}},
        {"requiredFeatures", r.required_features},
        {"stages", list(r.stages, stage_json)},
        {"groups", list(r.groups, group_json)},
        {"resources", list(r.resources, resource_json)},
        {"specConstants", list(r.spec_constants, spec_constant_json)},
        {"traceSites", list(r.trace_sites, trace_site_json)},
        {"assumptions", assumption_names(r.assumptions)},
        {"facts", list(r.facts, fact_json)},
    };
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

// Names come from SPIR-V, which may hold bytes that are no UTF-8: they become U+FFFD.
std::string reflection_to_json(const Reflection& reflection) {
    return to_json(reflection).dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string embedded_json(const Reflection& reflection) {
    Reflection placeless = reflection;
    for (StageReport& stage : placeless.stages) stage.file = last_component(stage.file);
    for (TraceSiteReport& site : placeless.trace_sites) site.file = last_component(site.file);
    return to_json(placeless).dump(-1, ' ', false, Json::error_handler_t::replace);
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
