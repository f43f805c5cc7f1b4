#include "trace_variant.h"

#include <algorithm>
#include <functional>
#include <map>
#include <sstream>

#include "error.h"

namespace rtc::bench {
namespace {

using tools::Error;

uint32_t number(const std::string& key, const std::string& value) {
    try {
        size_t used = 0;
        const unsigned long parsed = std::stoul(value, &used);
        if (used == value.size() && parsed <= 0xfffffffful) return uint32_t(parsed);
    } catch (const std::exception&) {
    }
    throw Error("variant: " + key + "=" + value + " is not a number");
}

// One of the words before the bars of `choices`, as its index.
uint32_t choice(const std::string& key, const std::string& value, const std::vector<std::string>& choices) {
    std::string list;
    for (size_t i = 0; i < choices.size(); ++i) {
        if (choices[i] == value) return uint32_t(i);
        list += (i ? ", " : "") + choices[i];
    }
    throw Error("variant: " + key + "=" + value + "; there are: " + list);
}

using Setter = std::function<void(TraceVariant&, const std::string& key, const std::string& value)>;

const std::map<std::string, Setter>& setters() {
    static const std::map<std::string, Setter> table = {
        {"name", [](auto& v, auto&, auto& value) { v.name = value; }},
        {"fetch",
         [](auto& v, auto& key, auto& value) {
             v.options.fetch = RtrFetch(choice(key, value, {"texel", "storage"}));
         }},
        {"loop",
         [](auto& v, auto& key, auto& value) { v.options.whileWhile = choice(key, value, {"if", "while"}); }},
        {"stack", [](auto& v, auto& key, auto& value) { v.options.sharedStack = number(key, value); }},
        {"workgroup", [](auto& v, auto& key, auto& value) { v.options.workgroupSize = number(key, value); }},
        {"budget", [](auto& v, auto& key, auto& value) { v.options.stepBudget = number(key, value); }},
        {"build", [](auto& v, auto& key, auto& value) { v.fast_build = choice(key, value, {"trace", "fast"}); }},
        {"addressing",
         [](auto& v, auto&, auto& value) { v.addressing = tools::addressing_from_name(value); }},
        {"resumable", [](auto& v, auto& key, auto& value) { v.resumable = int(choice(key, value, {"0", "1"})); }},
        {"optimize", [](auto& v, auto& key, auto& value) { v.optimize = choice(key, value, {"0", "1"}); }},
        {"specialize", [](auto& v, auto& key, auto& value) { v.specialize = choice(key, value, {"0", "1"}); }},
        {"assume",
         [](auto& v, auto&, auto& value) {
             v.assume = value;
             std::replace(v.assume.begin(), v.assume.end(), '+', ',');
         }},
        {"dialect", [](auto& v, auto& key, auto& value) { v.ext_dialect = choice(key, value, {"nv", "ext"}); }},
        {"modules", [](auto& v, auto&, auto& value) { v.modules = value; }},
    };
    return table;
}

}  // namespace

TraceVariant parse_variant(const std::string& text) {
    TraceVariant variant;
    std::istringstream parts(text);
    for (std::string part; std::getline(parts, part, ',');) {
        const size_t equals = part.find('=');
        const std::string key = part.substr(0, equals);
        const auto found = setters().find(key);
        if (found == setters().end() || equals == std::string::npos) {
            std::string list;
            for (const auto& entry : setters()) list += (list.empty() ? "" : ", ") + entry.first;
            throw Error("variant: '" + part + "' is not KEY=VALUE with one of the keys " + list);
        }
        found->second(variant, key, part.substr(equals + 1));
    }
    if (variant.name.empty()) variant.name = text.empty() ? "rtc" : "rtc " + text;
    return variant;
}

const char* variant_help() {
    return "a column of rtc, as KEY=VALUE,... (may be repeated; none: the device's defaults). Keys: name=TEXT, "
           "addressing=heap|address, fetch=texel|storage in a heap, loop=if|while, stack=ENTRIES in shared memory (0: "
           "local), workgroup=LANES, budget=TURNS before a lane suspends (0: never), build=trace|fast, resumable=0|1, "
           "optimize=0|1, specialize=0|1, assume=NAME+NAME, dialect=nv|ext, modules=FOLDER written by --save-modules";
}

std::string fetch_name(RtrFetch fetch) { return fetch == RTR_FETCH_TEXEL ? "texel" : "storage"; }

}  // namespace rtc::bench
