// What the core's tests share: SPIR-V from assembly text, and linking with one stage.
#pragma once

#include <string>
#include <vector>

#include "pipeline.h"

namespace rtc::test {

// Assembles text; fails the test (and returns nothing) when it does not assemble.
std::vector<uint32_t> assemble(const std::string& text, unsigned minor_version = 3);

struct Stage {
    StageKind kind;
    std::vector<uint32_t> spirv;
    std::string entry = "main";
    std::vector<SpecValue> specialization;
};

// A pipeline of these stages; general stages make groups of their own, each closest-hit a triangles group.
PipelineInput pipeline(const std::vector<Stage>& stages);

// Links quickly: no optimiser, validation of the result on.
LinkResult link(const std::vector<Stage>& stages, LinkOptions options = {});

// "id: file:line: text" a line, errors and warnings.
std::string describe(const LinkResult& result);
bool has_diagnostic(const LinkResult& result, const std::string& id, Severity severity = Severity::Error);

// Fails the test unless linking failed and gave at least one error with a text and an id.
void expect_clear_error(const LinkResult& result, const std::string& what);

// A module of one entry point `main` of the execution model (RayGenerationNV, MissNV, ...): `globals` after the common
// types, `body` in main's block. Common ids: %void %fn %bool %float %uint %int %v3float %float_0 %float_1 %uint_0
// %uint_255 %zero3 %up3 %as %ptr_as %scene (set 0, binding 0).
struct StageText {
    std::string model = "RayGenerationNV";
    std::string globals, body, annotations, functions;
    std::string preamble;   // further capabilities and extensions
    std::string interface;  // ids of the entry point's input variables
};
std::string stage_text(const StageText& parts);
std::string raygen_text(const std::string& globals, const std::string& body, const std::string& annotations = "",
                        const std::string& functions = "");

// A payload of one float at location 0, and a trace with it (numbers are NV's).
extern const char* const kPayload;
extern const char* const kPayloadLocation;
extern const char* const kTrace;
std::string trace_text(const std::string& flags, const std::string& mask, const std::string& offset,
                       const std::string& miss, const std::string& payload);

}  // namespace rtc::test
