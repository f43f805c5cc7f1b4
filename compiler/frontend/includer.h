// #include for glslang: the caller's callback, or the including file's folder
// and then the -I folders.
#pragma once

#include <glslang/Public/ShaderLang.h>

#include <string>
#include <vector>

#include "frontend/frontend.h"

namespace rtc {

class SourceIncluder final : public glslang::TShader::Includer {
  public:
    explicit SourceIncluder(const FrontendOptions& options) : options_(options) {}

    IncludeResult* includeSystem(const char* name, const char* includer, size_t depth) override;
    IncludeResult* includeLocal(const char* name, const char* includer, size_t depth) override;
    void releaseInclude(IncludeResult* result) override;

    const std::vector<std::string>& files() const { return files_; }
    bool names_ext() const { return names_ext_; }

  private:
    IncludeResult* answer(const IncludeRequest& request);

    const FrontendOptions& options_;
    std::vector<std::string> files_;  // resolved names in order of first inclusion
    bool names_ext_ = false;          // an included file asks for GL_EXT_ray_tracing
};

// Reads a whole file; false when it cannot be opened or is a folder.
bool read_text_file(const std::string& path, std::string& text);

}  // namespace rtc
