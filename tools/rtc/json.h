// JSON that remembers where each value stands, so that a mistake in a pipeline file
// is reported by file, line and column whether it is one of syntax or of meaning.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace cli {

struct JsonPlace {
    size_t line = 1, column = 1;
};

struct JsonValue {
    enum class Kind { Null, Bool, Number, String, Array, Object } kind = Kind::Null;
    JsonPlace place;
    std::string text;  // of a string, decoded; of a number, bool or null, as written
    std::vector<JsonValue> items;
    struct Member;
    std::vector<Member> members;  // in file order; names are unique
};

struct JsonValue::Member {
    std::string name;
    JsonPlace place;
    JsonValue value;
};

const char* json_kind_name(JsonValue::Kind kind);

// Throws InputError "file:line:column: error: …".
JsonValue parse_json(const std::string& text, const std::string& file);
[[noreturn]] void json_error(const std::string& file, JsonPlace place, const std::string& what);

}  // namespace cli
