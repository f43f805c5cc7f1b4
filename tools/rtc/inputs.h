// Files the user names, read once each.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace cli {

struct SourceFile {
    std::string name;  // as in messages: "-" is "<stdin>"
    std::string bytes;
    bool is_spirv = false;
    std::vector<uint32_t> words;  // of SPIR-V
};

class SourceFiles {
  public:
    // "-" reads stdin. Throws InputError when the file cannot be read or is damaged SPIR-V.
    std::shared_ptr<const SourceFile> open(const std::string& path);

  private:
    std::map<std::string, std::shared_ptr<const SourceFile>> open_;
};

std::string read_input(const std::string& path);
std::string last_component(const std::string& path);

}  // namespace cli
