#include "frontend/advice.h"

#include <array>
#include <cctype>
#include <string_view>

#include "frontend/frontend.h"
#include "frontend/scan.h"

namespace rtc {
namespace {

struct Spelling {
    std::string_view old_name;
    std::string_view advice;
};

constexpr std::array kSpellings = {
    Spelling{"gl_GlobalInvocationIDNV", "write gl_LaunchIDNV, a uvec3 (GL_NV_ray_tracing)"},
    Spelling{"gl_GlobalInvocationID", "ray tracing stages have gl_LaunchIDNV or gl_LaunchIDEXT instead"},
    Spelling{"gl_hitTNV", "write gl_HitTNV"},
    Spelling{"gl_hitTEXT", "write gl_HitTEXT"},
    Spelling{"gl_LaunchIDNVX", "write gl_LaunchIDNV"},
    Spelling{"gl_LaunchSizeNVX", "write gl_LaunchSizeNV"},
    Spelling{"gl_GeometryIndexNV",
             "GL_NV_ray_tracing has no geometry index; GL_EXT_ray_tracing has gl_GeometryIndexEXT"},
    Spelling{"gl_ObjectToWorld3x4NV", "GL_NV_ray_tracing has gl_ObjectToWorldNV only; transpose it"},
    Spelling{"gl_WorldToObject3x4NV", "GL_NV_ray_tracing has gl_WorldToObjectNV only; transpose it"},
    Spelling{"accelerationStructureNVX", "write accelerationStructureNV"},
    Spelling{"rayPayloadNVX", "write rayPayloadNV"},
    Spelling{"rayPayloadInNVX", "write rayPayloadInNV"},
    Spelling{"hitAttributeNVX", "write hitAttributeNV"},
    Spelling{"intersectionAttributesNV", "write hitAttributeNV"},
    Spelling{"traceNVX", "write traceNV"},
    Spelling{"reportIntersectionNVX", "write reportIntersectionNV"},
    Spelling{"ignoreIntersectionNVX", "write ignoreIntersectionNV"},
    Spelling{"terminateRayNVX", "write terminateRayNV"},
};

bool is_identifier_char(char c) { return std::isalnum(static_cast<unsigned char>(c)) || c == '_'; }

bool has_word(std::string_view text, std::string_view word) {
    for (size_t at = text.find(word); at != std::string_view::npos; at = text.find(word, at + 1)) {
        const bool left = at == 0 || !is_identifier_char(text[at - 1]);
        const bool right = at + word.size() >= text.size() || !is_identifier_char(text[at + word.size()]);
        if (left && right) return true;
    }
    return false;
}

bool contains(std::string_view text, std::string_view part) {
    return text.find(part) != std::string_view::npos;
}

std::vector<std::string> lines_of(const std::string& text) {
    std::vector<std::string> lines(1);
    for (char c : text) {
        if (c == '\n')
            lines.emplace_back();
        else
            lines.back() += c;
    }
    return lines;
}

std::string quoted_token(std::string_view text) {
    if (text.empty() || text[0] != '\'') return {};
    const size_t end = text.find('\'', 1);
    return end == std::string_view::npos ? std::string() : std::string(text.substr(1, end - 1));
}

// The line before `line` (1-based) that holds code, or empty.
std::string_view code_before(const std::vector<std::string>& code, uint32_t line) {
    for (size_t i = line; i-- > 1;) {
        std::string_view text = code.size() >= i ? std::string_view(code[i - 1]) : std::string_view();
        while (!text.empty() && std::isspace(static_cast<unsigned char>(text.back()))) text.remove_suffix(1);
        if (!text.empty()) return text;
    }
    return {};
}

std::string advice_for(const Diagnostic& message, std::string_view line_text,
                       const std::vector<std::string>& code) {
    const std::string_view text = message.text;
    const std::string token = quoted_token(text);
    if (contains(text, "extension not supported: GL_EXT_ray_tracing_position_fetch") ||
        token == "gl_HitTriangleVertexPositionsEXT")
        return "this glslang (" + glslang_version() +
               ") does not know position fetch; give the stage as SPIR-V from a newer front end";
    if (contains(text, "extension not supported: GL_NVX_raytracing"))
        return "write #extension GL_NV_ray_tracing : require";
    if (contains(text, "extension not supported: "))
        return "this glslang (" + glslang_version() + ") does not know it; give the stage as SPIR-V instead";
    // Both misspellings fail as tokens here, or inside an unknown call on the same line.
    for (const Spelling& spelling : kSpellings)
        if (token == spelling.old_name ||
            (token.empty() && contains(text, "syntax error") && has_word(line_text, spelling.old_name)))
            return std::string(spelling.advice);
    if (contains(text, "can only be used in uniform variables") ||
        contains(text, "requires uniform or buffer storage"))
        return "write `uniform` before the type";
    if (contains(text, "without a format layout qualifier"))
        return "give the image a format (layout(rgba8, …)) or declare it writeonly";
    if (contains(text, "maybe an instance name is needed"))
        return "a block's name is no variable: give the block an instance (`} name;`) and use that";
    if (contains(text, "syntax error")) {
        const std::string_view before = code_before(code, message.line);
        if (!before.empty() && before.back() == '}' && contains(text, "expecting SEMICOLON"))
            return "a block before this ends in `}`; end it with `};` or an instance name";
    }
    if (contains(text, "required extension not requested"))
        return "write #extension GL_NV_ray_tracing : require or #extension GL_EXT_ray_tracing : require";
    if (token == "imageStore" && contains(text, "no matching overloaded function"))
        return "coordinates are ivec2/ivec3: convert gl_LaunchIDNV.xy with ivec2(…)";
    return {};
}

void add_spellings(const std::string& file, const std::vector<std::string>& code, uint32_t after,
                   std::vector<Diagnostic>& diagnostics) {
    for (uint32_t line = after + 1; line <= code.size(); ++line)
        for (const Spelling& spelling : kSpellings)
            if (has_word(code[line - 1], spelling.old_name))
                diagnostics.push_back(
                    {Severity::Error, "glsl-old-spelling", file, line,
                     "'" + std::string(spelling.old_name) + "' : " + std::string(spelling.advice)});
}

}  // namespace

void add_advice(const std::string& file, const std::string& source, std::vector<Diagnostic>& diagnostics) {
    bool any = false;
    for (const Diagnostic& message : diagnostics) any |= message.severity == Severity::Error;
    if (!any) return;

    const std::vector<std::string> code = lines_of(strip_comments(source));
    for (Diagnostic& message : diagnostics) {
        if (message.severity != Severity::Error) continue;
        const bool here = message.file == file && message.line >= 1 && message.line <= code.size();
        const std::string advice =
            advice_for(message, here ? std::string_view(code[message.line - 1]) : "", code);
        if (contains(message.text, "GL_EXT_ray_tracing_position_fetch")) message.id = "position-fetch-glsl";
        if (!advice.empty()) message.text += "; " + advice;
    }

    // A syntax error ends the parse: what is misspelled behind it is told all the same.
    for (size_t i = 0, count = diagnostics.size(); i < count; ++i)
        if (diagnostics[i].file == file && contains(diagnostics[i].text, "syntax error"))
            return add_spellings(file, code, diagnostics[i].line, diagnostics);
}

std::string extension_used(const std::string& source) {
    const std::string code = strip_comments(source);
    for (std::string_view word : {"accelerationStructure", "rayPayload", "rayPayloadIn", "hitAttribute",
                                  "callableData", "callableDataIn", "shaderRecord", "gl_LaunchID"})
        for (std::string_view dialect : {"NV", "EXT"})
            if (has_word(code, std::string(word) + std::string(dialect)))
                return "GL_" + std::string(dialect) + "_ray_tracing";
    return {};
}

}  // namespace rtc
