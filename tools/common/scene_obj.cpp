#include "scene_files.h"

#include <tiny_obj_loader.h>

#include <map>
#include <tuple>

#include "error.h"
#include "mesh_tools.h"

namespace rtc::tools {
namespace {

// OBJ says nothing about smoothing groups that survives export reliably: normals, where missing, are
// made with this crease angle.
constexpr float kCreaseDegrees = 45.0f;

Material convert(const tinyobj::material_t& source, Scene& scene, const std::string& folder,
                 std::map<std::string, uint32_t>& textures) {
    Material material;
    material.name = source.name;
    material.base_color = {source.diffuse[0], source.diffuse[1], source.diffuse[2]};
    material.emission = {source.emission[0], source.emission[1], source.emission[2]};
    material.emits_both_sides = true;
    // The PBR extension where the file has it, else the Phong exponent (Walter et al. 2007, a =
    // sqrt(2/(n+2))).
    material.metallic = source.metallic;
    material.roughness =
        source.roughness > 0 ? source.roughness : std::sqrt(std::sqrt(2.0f / (source.shininess + 2.0f)));
    if (!source.diffuse_texname.empty()) {
        auto [place, fresh] = textures.try_emplace(source.diffuse_texname, uint32_t(scene.textures.size()));
        if (fresh) scene.textures.push_back(read_picture(folder + source.diffuse_texname));
        material.base_color_texture = place->second;
    }
    return material;
}

}  // namespace

Scene load_obj(const std::string& path) {
    tinyobj::ObjReaderConfig config;
    config.triangulate = true;
    tinyobj::ObjReader reader;
    if (!reader.ParseFromFile(path, config)) throw Error(path + ": " + reader.Error());
    const tinyobj::attrib_t& attributes = reader.GetAttrib();

    Scene scene;
    scene.name = path;
    const size_t slash = path.find_last_of('/');
    const std::string folder = slash == std::string::npos ? "" : path.substr(0, slash + 1);
    std::map<std::string, uint32_t> textures;
    for (const tinyobj::material_t& source : reader.GetMaterials())
        scene.materials.push_back(convert(source, scene, folder, textures));
    if (scene.materials.empty()) scene.materials.emplace_back();

    for (const tinyobj::shape_t& shape : reader.GetShapes()) {
        Mesh mesh;
        mesh.name = shape.name.empty() ? path : shape.name;
        bool normals = !attributes.normals.empty(), uvs = !attributes.texcoords.empty();
        for (const tinyobj::index_t& index : shape.mesh.indices) {
            normals = normals && index.normal_index >= 0;
            uvs = uvs && index.texcoord_index >= 0;
        }
        std::map<std::tuple<int, int, int>, uint32_t> known;
        for (const tinyobj::index_t& index : shape.mesh.indices) {
            if (index.vertex_index < 0 || size_t(index.vertex_index) * 3 + 2 >= attributes.vertices.size())
                throw Error(path + ": a face names a vertex that is not there");
            auto [place, fresh] = known.try_emplace(
                {index.vertex_index, normals ? index.normal_index : -1, uvs ? index.texcoord_index : -1},
                uint32_t(mesh.positions.size()));
            if (fresh) {
                const float* v = &attributes.vertices[size_t(index.vertex_index) * 3];
                mesh.positions.push_back({v[0], v[1], v[2]});
                if (normals) {
                    const float* n = &attributes.normals.at(size_t(index.normal_index) * 3);
                    mesh.normals.push_back({n[0], n[1], n[2]});
                }
                if (uvs) {
                    const float* uv = &attributes.texcoords.at(size_t(index.texcoord_index) * 2);
                    mesh.uvs.push_back({uv[0], 1.0f - uv[1]});
                }
            }
            mesh.indices.push_back(place->second);
        }
        if (mesh.indices.empty()) continue;
        for (int material : shape.mesh.material_ids)
            mesh.materials.push_back(material < 0 ? 0u : uint32_t(material));
        if (!normals) add_smooth_normals(mesh, kCreaseDegrees);
        Instance instance;
        instance.mesh = uint32_t(scene.meshes.size());
        scene.meshes.push_back(std::move(mesh));
        scene.instances.push_back(instance);
    }
    scene.finish(false);
    return scene;
}

}  // namespace rtc::tools
