// Scenes for rtc-run: meshes, boxes and instances in JSON, or a model file.
#include <algorithm>
#include <cstring>
#include <filesystem>

#include "../common/scene.h"
#include "files.h"
#include "job.h"

namespace rtc::run {

using native::Bottom;
using native::Geometry;
using native::Placement;
using native::Top;
using native::World;
using tools::Error;

namespace {

void flatten(const Json& value, std::vector<float>& out) {
    if (value.is_array()) {
        for (const Json& inner : value) flatten(inner, out);
        return;
    }
    uint64_t bits = number_bits(value, Type::Kind::Float, 32);
    uint32_t word = uint32_t(bits);
    float number;
    std::memcpy(&number, &word, 4);
    out.push_back(number);
}

void only_keys(const Json& json, std::initializer_list<const char*> known, const char* what) {
    if (!json.is_object()) throw Error(std::string(what) + " must be a JSON object, not " + json.dump());
    for (const auto& [key, value] : json.items())
        if (std::find(known.begin(), known.end(), key) == known.end()) {
            std::string all;
            for (const char* k : known) all += std::string(" ") + k;
            throw Error(std::string(what) + ": unknown key '" + key + "'; known:" + all);
        }
}

uint32_t flags_of(const Json& json, std::initializer_list<std::pair<const char*, uint32_t>> names,
                  const char* what) {
    if (json.is_number()) return json.get<uint32_t>();
    uint32_t flags = 0;
    for (const Json& item : json) {
        auto found = std::find_if(names.begin(), names.end(),
                                  [&](const auto& entry) { return item.get<std::string>() == entry.first; });
        if (found == names.end()) {
            std::string all;
            for (const auto& entry : names) all += std::string(" ") + entry.first;
            throw Error(std::string(what) + ": unknown flag " + item.dump() + "; known:" + all);
        }
        flags |= found->second;
    }
    return flags;
}

Geometry geometry_of(const Json& json) {
    only_keys(json, {"triangles", "vertices", "indices", "boxes", "flags", "transform"}, "geometry");
    Geometry geometry;
    if (json.contains("boxes")) {
        geometry.boxes = true;
        flatten(json["boxes"], geometry.bounds);
        if (geometry.bounds.size() % 6) throw Error("boxes: six numbers each, min xyz and max xyz");
    } else {
        flatten(json.contains("triangles") ? json["triangles"] : json.value("vertices", Json::array()),
                geometry.positions);
        if (json.contains("triangles") ? geometry.positions.size() % 9 : geometry.positions.size() % 3)
            throw Error("triangles: nine numbers each; vertices: three each");
        if (json.contains("indices")) {
            std::vector<float> numbers;
            flatten(json["indices"], numbers);
            for (float n : numbers) geometry.indices.push_back(uint32_t(n));
            if (geometry.indices.size() % 3) throw Error("indices: three a triangle");
            for (uint32_t index : geometry.indices)
                if (index >= geometry.positions.size() / 3)
                    throw Error("index " + std::to_string(index) + " is past the last vertex");
        }
        if (json.contains("transform")) {
            flatten(json["transform"], geometry.transform);
            if (geometry.transform.size() != 12) throw Error("transform: twelve numbers, three rows of four");
        }
    }
    geometry.flags = flags_of(json.value("flags", Json::array()),
                              {{"opaque", VK_GEOMETRY_OPAQUE_BIT_KHR},
                               {"no-duplicate-any-hit", VK_GEOMETRY_NO_DUPLICATE_ANY_HIT_INVOCATION_BIT_KHR}},
                              "geometry flags");
    return geometry;
}

Placement instance_of(const Json& json, const World& world) {
    only_keys(json, {"mesh", "transform", "custom", "mask", "offset", "flags"}, "instance");
    Placement placement;
    if (json.contains("mesh") && !json["mesh"].is_null()) {
        const Json& mesh = json["mesh"];
        if (mesh.is_number()) {
            placement.bottom = mesh.get<int>();
        } else {
            for (size_t i = 0; i < world.bottoms.size(); ++i)
                if (world.bottoms[i].name == mesh.get<std::string>()) placement.bottom = int(i);
            if (placement.bottom < 0) throw Error("instance: there is no mesh " + mesh.dump());
        }
        if (placement.bottom < 0 || size_t(placement.bottom) >= world.bottoms.size())
            throw Error("instance: there is no mesh " + mesh.dump());
    }
    if (json.contains("transform")) {
        std::vector<float> numbers;
        flatten(json["transform"], numbers);
        if (numbers.size() != 12) throw Error("instance transform: twelve numbers, three rows of four");
        std::copy(numbers.begin(), numbers.end(), placement.transform);
    }
    placement.custom_index = json.value("custom", 0u);
    placement.mask = json.value("mask", 0xffu);
    placement.sbt_offset = json.value("offset", 0u);
    placement.flags = flags_of(json.value("flags", Json::array()),
                               {{"cull-disable", VK_GEOMETRY_INSTANCE_TRIANGLE_FACING_CULL_DISABLE_BIT_KHR},
                                {"front-ccw", VK_GEOMETRY_INSTANCE_TRIANGLE_FRONT_COUNTERCLOCKWISE_BIT_KHR},
                                {"force-opaque", VK_GEOMETRY_INSTANCE_FORCE_OPAQUE_BIT_KHR},
                                {"force-no-opaque", VK_GEOMETRY_INSTANCE_FORCE_NO_OPAQUE_BIT_KHR}},
                               "instance flags");
    return placement;
}

}  // namespace

World parse_scene(const Json& json, const std::string& folder) {
    if (json.is_string())
        return load_scene((std::filesystem::path(folder) / json.get<std::string>()).string());
    only_keys(json, {"meshes", "instances", "tops"}, "scene");
    World world;
    for (const Json& mesh : json.value("meshes", Json::array())) {
        only_keys(mesh,
                  {"name", "geometries", "built-from", "file", "flags", "triangles", "vertices", "indices", "boxes",
                   "geometry-flags"},
                  "mesh");
        Bottom bottom;
        bottom.name = mesh.value("name", "mesh" + std::to_string(world.bottoms.size()));
        if (mesh.contains("file")) {
            World loaded =
                load_scene((std::filesystem::path(folder) / mesh["file"].get<std::string>()).string());
            for (Bottom& part : loaded.bottoms)
                for (Geometry& geometry : part.geometries) bottom.geometries.push_back(std::move(geometry));
        } else if (mesh.contains("geometries")) {
            for (const Json& geometry : mesh["geometries"])
                bottom.geometries.push_back(geometry_of(geometry));
        } else {
            Json geometry = mesh;
            for (const char* key : {"name", "flags", "geometry-flags"}) geometry.erase(key);
            if (mesh.contains("geometry-flags")) geometry["flags"] = mesh["geometry-flags"];
            bottom.geometries.push_back(geometry_of(geometry));
        }
        bottom.flags =
            mesh.contains("flags")
                ? flags_of(mesh["flags"],
                           {{"fast-trace", VK_BUILD_ACCELERATION_STRUCTURE_PREFER_FAST_TRACE_BIT_KHR},
                            {"fast-build", VK_BUILD_ACCELERATION_STRUCTURE_PREFER_FAST_BUILD_BIT_KHR},
                            {"low-memory", VK_BUILD_ACCELERATION_STRUCTURE_LOW_MEMORY_BIT_KHR},
                            {"allow-update", VK_BUILD_ACCELERATION_STRUCTURE_ALLOW_UPDATE_BIT_KHR},
                            {"allow-data-access", 0x800}},  // of VK_KHR_ray_tracing_position_fetch
                           "mesh flags")
                : bottom.flags;
        if (mesh.contains("built-from")) {
            if (!mesh.contains("geometries")) throw Error("'built-from' needs 'geometries'");
            for (const Json& geometry : mesh["built-from"]) bottom.built_from.push_back(geometry_of(geometry));
            bottom.flags |= VK_BUILD_ACCELERATION_STRUCTURE_ALLOW_UPDATE_BIT_KHR;
        }
        world.bottoms.push_back(std::move(bottom));
    }
    auto top_of = [&](const std::string& name, const Json& instances) {
        Top top;
        top.name = name;
        for (const Json& instance : instances) top.instances.push_back(instance_of(instance, world));
        world.tops.push_back(std::move(top));
    };
    if (json.contains("tops")) {
        for (const auto& [name, instances] : json["tops"].items()) top_of(name, instances);
    } else if (json.contains("instances")) {
        top_of("main", json["instances"]);
    } else {  // every mesh once
        Json instances = Json::array();
        for (size_t i = 0; i < world.bottoms.size(); ++i) instances.push_back({{"mesh", i}, {"custom", i}});
        top_of("main", instances);
    }
    return world;
}

World load_scene(const std::string& path) {
    std::filesystem::path p(path);
    if (p.extension() == ".json") {
        const Json json = read_json(path);
        try {
            return parse_scene(json, p.parent_path().string());
        } catch (const Json::exception& e) {
            throw Error(path + ": " + problem_of(e));
        } catch (const Error& e) {
            throw Error(path + ": " + e.what());
        }
    }
    return native::world_of(tools::load_scene(path));
}

World default_scene() {
    return parse_scene(
        Json::parse(R"({"meshes": [{"name": "triangle", "triangles": [[-1,-1,2, 3,-1,2, -1,3,2]]}]})"), ".");
}

}  // namespace rtc::run
