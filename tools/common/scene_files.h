// The loaders behind load_scene(), one file each.
#pragma once

#include <string>

#include "scene.h"

namespace rtc::tools {

Scene load_obj(const std::string& path);
Scene load_gltf(const std::string& path);  // .gltf and .glb

}  // namespace rtc::tools
