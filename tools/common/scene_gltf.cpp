#include "scene_files.h"

#include <tiny_gltf.h>

#include <cstring>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/gtc/type_ptr.hpp>

#include "error.h"

namespace rtc::tools {
namespace {

class Loader {
  public:
    explicit Loader(const std::string& path) : path_(path) {
        tinygltf::TinyGLTF reader;
        std::string problem, warning;
        const bool binary = path.size() > 4 && path.compare(path.size() - 4, 4, ".glb") == 0;
        const bool ok = binary ? reader.LoadBinaryFromFile(&model_, &problem, &warning, path)
                               : reader.LoadASCIIFromFile(&model_, &problem, &warning, path);
        if (!ok) throw Error(path + ": " + (problem.empty() ? "not a glTF file" : problem));
        for (const std::string& extension : model_.extensionsRequired)
            if (extension != "KHR_materials_emissive_strength" && extension != "KHR_lights_punctual")
                throw Error(path + ": requires the glTF extension " + extension + ", which is not supported");
    }

    Scene load() {
        scene_.name = path_;
        for (const tinygltf::Image& image : model_.images) scene_.textures.push_back(convert(image));
        for (const tinygltf::Material& material : model_.materials)
            scene_.materials.push_back(convert(material));
        scene_.materials.emplace_back();  // for primitives that name none
        for (const tinygltf::Mesh& mesh : model_.meshes) load_mesh(mesh);
        const int which = model_.defaultScene >= 0 ? model_.defaultScene : 0;
        if (which < int(model_.scenes.size()))
            for (int node : model_.scenes[size_t(which)].nodes) visit(node, glm::mat4(1.0f), 0);
        scene_.finish(has_camera_);
        return std::move(scene_);
    }

  private:
    [[noreturn]] void fail(const std::string& what) const { throw Error(path_ + ": " + what); }

    template <typename T>
    const T& at(const std::vector<T>& list, int index, const char* what) const {
        if (index < 0 || size_t(index) >= list.size()) fail(std::string("names a missing ") + what);
        return list[size_t(index)];
    }

    // Linear RGBA from glTF's 8- or 16-bit sRGB images.
    Picture convert(const tinygltf::Image& image) const {
        if (image.width <= 0 || image.height <= 0 || image.component <= 0 || image.image.empty())
            fail("image '" + image.name + "' could not be read");
        Picture picture(uint32_t(image.width), uint32_t(image.height), 4);
        const bool wide = image.bits == 16;
        for (size_t p = 0; p < size_t(image.width) * size_t(image.height); ++p)
            for (int c = 0; c < 4; ++c) {
                float value = c == 3 ? 1.0f : 0.0f;
                const int from = image.component >= 3 ? c : (c == 3 ? image.component - 1 : 0);
                if (from < image.component && !(c == 3 && image.component % 2)) {
                    const size_t place = p * size_t(image.component) + size_t(from);
                    if (wide) {
                        uint16_t word;
                        std::memcpy(&word, &image.image[place * 2], 2);
                        value = float(word) / 65535.0f;
                    } else {
                        value = float(image.image[place]) / 255.0f;
                    }
                    if (c < 3)
                        value =
                            value <= 0.04045f ? value / 12.92f : std::pow((value + 0.055f) / 1.055f, 2.4f);
                }
                picture.pixels[p * 4 + size_t(c)] = value;
            }
        return picture;
    }

    Material convert(const tinygltf::Material& source) const {
        Material material;
        material.name = source.name;
        const tinygltf::PbrMetallicRoughness& pbr = source.pbrMetallicRoughness;
        for (int c = 0; c < 3; ++c) {
            material.base_color[c] = float(pbr.baseColorFactor[size_t(c)]);
            material.emission[c] = float(source.emissiveFactor[size_t(c)]);
        }
        auto strength = source.extensions.find("KHR_materials_emissive_strength");
        if (strength != source.extensions.end() && strength->second.Has("emissiveStrength"))
            material.emission *= float(strength->second.Get("emissiveStrength").GetNumberAsDouble());
        material.metallic = float(pbr.metallicFactor);
        material.roughness = float(pbr.roughnessFactor);
        material.emits_both_sides = source.doubleSided;
        material.alpha_tested = source.alphaMode == "MASK";
        if (pbr.baseColorTexture.index >= 0) {
            const int image = at(model_.textures, pbr.baseColorTexture.index, "texture").source;
            at(model_.images, image, "image");
            material.base_color_texture = uint32_t(image);
        }
        return material;
    }

    // One component of one element of an accessor, as glTF 2.0 §3.6.2.2 defines it.
    double component(const tinygltf::Accessor& accessor, size_t element, size_t index) const {
        const tinygltf::BufferView& view = at(model_.bufferViews, accessor.bufferView, "buffer view");
        const tinygltf::Buffer& buffer = at(model_.buffers, view.buffer, "buffer");
        const int size = tinygltf::GetComponentSizeInBytes(uint32_t(accessor.componentType));
        const int stride = accessor.ByteStride(view);
        if (size <= 0 || stride <= 0) fail("an accessor has an unknown type");
        const size_t place =
            view.byteOffset + accessor.byteOffset + element * size_t(stride) + index * size_t(size);
        if (place + size_t(size) > buffer.data.size()) fail("an accessor reaches beyond its buffer");
        const uint8_t* bytes = &buffer.data[place];
        auto read = [&](auto value) {
            std::memcpy(&value, bytes, sizeof value);
            return value;
        };
        const bool unit = accessor.normalized;
        switch (accessor.componentType) {
            case TINYGLTF_COMPONENT_TYPE_FLOAT:
                return read(0.0f);
            case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
                return read(uint8_t(0)) / (unit ? 255.0 : 1.0);
            case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
                return read(uint16_t(0)) / (unit ? 65535.0 : 1.0);
            case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
                return read(uint32_t(0));
            case TINYGLTF_COMPONENT_TYPE_BYTE:
                return std::max(-1.0, read(int8_t(0)) / (unit ? 127.0 : 1.0));
            case TINYGLTF_COMPONENT_TYPE_SHORT:
                return std::max(-1.0, read(int16_t(0)) / (unit ? 32767.0 : 1.0));
            default:
                fail("an accessor has an unknown component type");
        }
    }

    template <int N>
    std::vector<glm::vec<N, float>> vectors(int index) const {
        const tinygltf::Accessor& accessor = at(model_.accessors, index, "accessor");
        if (accessor.sparse.isSparse) fail("sparse accessors are not supported");
        if (tinygltf::GetNumComponentsInType(uint32_t(accessor.type)) < N)
            fail("an attribute has too few components");
        std::vector<glm::vec<N, float>> values(accessor.count);
        for (size_t i = 0; i < values.size(); ++i)
            for (int c = 0; c < N; ++c) values[i][c] = float(component(accessor, i, size_t(c)));
        return values;
    }

    // A glTF mesh becomes one Mesh per primitive.
    void load_mesh(const tinygltf::Mesh& source) {
        std::vector<uint32_t>& parts = parts_.emplace_back();
        for (const tinygltf::Primitive& primitive : source.primitives) {
            if (primitive.mode != TINYGLTF_MODE_TRIANGLES && primitive.mode != -1) continue;  // points, lines
            Mesh mesh;
            mesh.name = source.name;
            auto attribute = [&](const char* name) {
                auto found = primitive.attributes.find(name);
                return found == primitive.attributes.end() ? -1 : found->second;
            };
            if (attribute("POSITION") < 0) continue;
            mesh.positions = vectors<3>(attribute("POSITION"));
            if (attribute("NORMAL") >= 0) mesh.normals = vectors<3>(attribute("NORMAL"));
            if (attribute("TEXCOORD_0") >= 0) mesh.uvs = vectors<2>(attribute("TEXCOORD_0"));
            if (primitive.indices >= 0) {
                const tinygltf::Accessor& accessor = at(model_.accessors, primitive.indices, "accessor");
                for (size_t i = 0; i < accessor.count; ++i)
                    mesh.indices.push_back(uint32_t(component(accessor, i, 0)));
            } else {
                for (uint32_t i = 0; i < mesh.positions.size(); ++i) mesh.indices.push_back(i);
            }
            mesh.material = primitive.material >= 0 ? uint32_t(primitive.material)
                                                    : uint32_t(scene_.materials.size() - 1);
            if (mesh.material >= scene_.materials.size()) fail("names a missing material");
            mesh.opaque = !scene_.materials[mesh.material].alpha_tested;
            for (uint32_t index : mesh.indices)
                if (index >= mesh.positions.size()) fail("an index reaches beyond its vertices");
            parts.push_back(uint32_t(scene_.meshes.size()));
            scene_.meshes.push_back(std::move(mesh));
        }
    }

    static glm::mat4 local_transform(const tinygltf::Node& node) {
        if (node.matrix.size() == 16) return glm::mat4(glm::make_mat4(node.matrix.data()));
        glm::mat4 transform(1.0f);
        if (node.translation.size() == 3)
            transform = glm::translate(transform, glm::vec3(glm::make_vec3(node.translation.data())));
        if (node.rotation.size() == 4)
            transform *= glm::mat4_cast(glm::quat(float(node.rotation[3]), float(node.rotation[0]),
                                                  float(node.rotation[1]), float(node.rotation[2])));
        if (node.scale.size() == 3)
            transform = glm::scale(transform, glm::vec3(glm::make_vec3(node.scale.data())));
        return transform;
    }

    void visit(int index, const glm::mat4& parent, int depth) {
        if (depth > 256) fail("its nodes form a cycle");
        const tinygltf::Node& node = at(model_.nodes, index, "node");
        const glm::mat4 transform = parent * local_transform(node);
        if (node.mesh >= 0)
            for (uint32_t part : at(parts_, node.mesh, "mesh")) {
                Instance instance;
                instance.mesh = part;
                instance.transform = transform;
                scene_.instances.push_back(instance);
            }
        if (node.camera >= 0 && !has_camera_) {
            const tinygltf::Camera& camera = at(model_.cameras, node.camera, "camera");
            if (camera.type == "perspective") {
                scene_.camera.eye = glm::vec3(transform[3]);
                scene_.camera.target = scene_.camera.eye - glm::vec3(transform[2]);
                scene_.camera.up = glm::vec3(transform[1]);
                scene_.camera.fov_y = float(camera.perspective.yfov);
                has_camera_ = true;
            }
        }
        auto light = node.extensions.find("KHR_lights_punctual");
        if (light != node.extensions.end() && light->second.Has("light")) {
            const tinygltf::Light& source =
                at(model_.lights, light->second.Get("light").GetNumberAsInt(), "light");
            // Candela to W/sr at 683 lm/W would make exported lamps invisible at exposure 1; like most
            // viewers, take the number as radiant intensity.
            glm::vec3 color(1.0f);
            for (size_t c = 0; c < 3 && c < source.color.size(); ++c) color[int(c)] = float(source.color[c]);
            if (source.type == "point" || source.type == "spot")
                scene_.lights.push_back({glm::vec3(transform[3]), color * float(source.intensity)});
        }
        for (int child : node.children) visit(child, transform, depth + 1);
    }

    std::string path_;
    tinygltf::Model model_;
    Scene scene_;
    std::vector<std::vector<uint32_t>> parts_;  // meshes of each glTF mesh
    bool has_camera_ = false;
};

}  // namespace

Scene load_gltf(const std::string& path) { return Loader(path).load(); }

}  // namespace rtc::tools
