#include "frontend/includer.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "frontend/scan.h"

namespace rtc {
namespace {

// glslang recurses into includes; a cycle must end before its stack does.
constexpr size_t kMaxIncludeDepth = 200;

std::string folder_of(const std::string& file) {
    const size_t slash = file.find_last_of("/\\");
    return slash == std::string::npos ? std::string() : file.substr(0, slash + 1);
}

std::string joined(const std::string& folder, const std::string& name) {
    if (folder.empty() || std::filesystem::path(name).is_absolute()) return name;
    return folder.back() == '/' || folder.back() == '\\' ? folder + name : folder + "/" + name;
}

IncludeAnswer find_on_disk(const IncludeRequest& request, const std::vector<std::string>& directories) {
    IncludeAnswer answer;
    std::vector<std::string> places;
    if (request.local) places.push_back(folder_of(request.includer));
    places.insert(places.end(), directories.begin(), directories.end());
    for (const std::string& place : places) {
        const std::string path = joined(place, request.name);
        if (read_text_file(path, answer.text)) {
            answer.ok = true;
            answer.name = path;
            return answer;
        }
    }
    answer.text = "cannot find or open include file";
    return answer;
}

}  // namespace

bool read_text_file(const std::string& path, std::string& text) {
    std::error_code error;
    if (std::filesystem::is_directory(path, error)) return false;
    std::ifstream stream(path, std::ios::binary);
    if (!stream) return false;
    text.assign(std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>());
    return true;
}

SourceIncluder::IncludeResult* SourceIncluder::answer(const IncludeRequest& request) {
    auto* answer = new IncludeAnswer;
    if (request.depth > kMaxIncludeDepth)
        answer->text = "too many levels of inclusion (a file that includes itself?)";
    else
        *answer = options_.include ? options_.include(request)
                                   : find_on_disk(request, options_.include_directories);
    if (!answer->ok) answer->name.clear();
    if (answer->ok) {
        if (std::find(files_.begin(), files_.end(), answer->name) == files_.end())
            files_.push_back(answer->name);
        names_ext_ |= scan_source(answer->text).names_ext;
    }
    return new IncludeResult(answer->name, answer->text.data(), answer->text.size(), answer);
}

// One search does both kinds: the local one falls through to the -I folders itself.
SourceIncluder::IncludeResult* SourceIncluder::includeSystem(const char* name, const char* includer,
                                                             size_t depth) {
    return answer({name, includer ? includer : "", false, depth});
}

SourceIncluder::IncludeResult* SourceIncluder::includeLocal(const char* name, const char* includer,
                                                            size_t depth) {
    return answer({name, includer ? includer : "", true, depth});
}

void SourceIncluder::releaseInclude(IncludeResult* result) {
    if (!result) return;
    delete static_cast<IncludeAnswer*>(result->userData);
    delete result;
}

}  // namespace rtc
