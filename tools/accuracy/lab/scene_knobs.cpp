#include "scene_knobs.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>

#include "error.h"
#include "rtc/abi.h"

namespace rtc::lab {
namespace {

constexpr uint32_t kSmallNodeQuads = 2, kGridQuads = 2;

float number(uint32_t word) { return std::bit_cast<float>(word); }

// One axis of the grid of a structure: `cell` is what lab_nodes.glsl computes.
struct Grid {
    float origin = 0, step = 1;
    float cell(uint32_t n) const {
        const volatile float way = float(n) * step;  // exact
        return origin + way;
    }
    // The last cell that is not above `x`, the first that is not below.
    uint32_t below(float x) const {
        uint32_t n = guess(x);
        while (n > 0 && cell(n) > x) --n;
        while (n < 0xffff && cell(n + 1) <= x) ++n;
        return n;
    }
    uint32_t above(float x) const {
        uint32_t n = guess(x);
        while (n < 0xffff && cell(n) < x) ++n;
        while (n > 0 && cell(n - 1) >= x) --n;
        return n;
    }

  private:
    uint32_t guess(float x) const {
        return uint32_t(std::clamp(std::floor((double(x) - origin) / step), 0.0, 65535.0));
    }
};

Grid grid_over(float low, float high) {
    if (!(std::isfinite(low) && std::isfinite(high))) throw tools::Error("boxes of fewer bits have to be finite");
    Grid grid{low, 0};
    // Not below 2^-126, so that nothing is flushed; 65 535 cells reach the end, which is rounded too.
    int exponent = std::max(-126, std::ilogb(std::max((double(high) - low) / 65535, 1e-300)));
    while (grid.step = float(std::ldexp(1.0, exponent)), grid.cell(0xffff) < high) ++exponent;
    return grid;
}

struct Cells {
    uint32_t low[3], high[3];
};

Cells cells_of(const Grid (&grids)[3], const uint32_t* low, const uint32_t* high) {
    Cells cells;
    for (int i = 0; i < 3; ++i) {
        const bool empty = !(number(low[i]) <= number(high[i]));
        cells.low[i] = empty ? 0 : grids[i].below(number(low[i]));
        cells.high[i] = empty ? 0 : grids[i].above(number(high[i]));
    }
    return cells;
}

void write_16(const Cells (&children)[2], uint32_t* node) {
    for (int c = 0; c < 2; ++c) {
        const Cells& b = children[c];
        node[c * 4] = b.low[0] | b.low[1] << 16;
        node[c * 4 + 1] = b.low[2] | b.high[0] << 16;
        node[c * 4 + 2] = b.high[1] | b.high[2] << 16;
    }
}

// Twelve numbers of 8 bits, then the node's origin and shifts on the grid of 16 bits.
void write_8(const Cells (&children)[2], uint32_t* node) {
    uint32_t origin[3], shift[3];
    uint8_t numbers[12];
    for (int i = 0; i < 3; ++i) {
        origin[i] = std::min(children[0].low[i], children[1].low[i]);
        const uint32_t end = std::max(children[0].high[i], children[1].high[i]) - origin[i];
        for (shift[i] = 0; (end + (1u << shift[i]) - 1) >> shift[i] > 255;) ++shift[i];
        for (int c = 0; c < 2; ++c) {
            numbers[c * 6 + i] = uint8_t((children[c].low[i] - origin[i]) >> shift[i]);
            numbers[c * 6 + 3 + i] = uint8_t((children[c].high[i] - origin[i] + (1u << shift[i]) - 1) >> shift[i]);
        }
    }
    for (int w = 0; w < 3; ++w)
        node[w] = numbers[w * 4] | numbers[w * 4 + 1] << 8 | numbers[w * 4 + 2] << 16 | uint32_t(numbers[w * 4 + 3]) << 24;
    node[4] = origin[0] | origin[1] << 16;
    node[5] = origin[2] | shift[0] << 16 | shift[1] << 20 | shift[2] << 24;
    node[6] = 0;
}

// Appends the structure at quad `base` of `from`; gives its quad in `to`.
uint32_t copy_small(const std::vector<uint32_t>& from, uint32_t base, int bits, std::vector<uint32_t>& to) {
    const uint32_t* old = &from[size_t(base) * 4];
    const uint32_t nodes = old[RTC_HDR_NODE_COUNT];
    const uint32_t old_slots = old[RTC_HDR_SLOTS], slots = RTC_AS_HEADER_QUADS + kGridQuads + nodes * kSmallNodeQuads;
    const uint32_t quads = old[RTC_HDR_SIZE_QUADS] - old_slots + slots;
    const uint32_t at = uint32_t(to.size() / 4);
    const size_t align = RTC_AS_ALIGNMENT / 4;
    to.resize(to.size() + (size_t(quads) * 4 + align - 1) / align * align);
    uint32_t* out = &to[size_t(at) * 4];
    std::copy_n(old, RTC_AS_HEADER_QUADS * 4, out);
    out[RTC_HDR_SELF_LO] = at;
    out[RTC_HDR_SIZE_QUADS] = quads;
    out[RTC_HDR_SLOTS] = slots;
    std::copy_n(old + old_slots * 4, (old[RTC_HDR_SIZE_QUADS] - old_slots) * 4, out + slots * 4);

    const uint32_t* node = old + old[RTC_HDR_NODES] * 4;
    // Of all boxes: inflated ones are larger than the structure.
    Grid grids[3];
    for (int i = 0; i < 3; ++i) {
        float low = INFINITY, high = -INFINITY;
        for (uint32_t n = 0; n < nodes; ++n)
            for (int c = 0; c < 2; ++c) {
                const uint32_t* child = node + n * RTC_NODE_QUADS * 4 + c * 8;
                if (!(number(child[i]) <= number(child[4 + i]))) continue;  // none there
                low = std::min(low, number(child[i]));
                high = std::max(high, number(child[4 + i]));
            }
        if (low <= high) grids[i] = grid_over(low, high);
        out[RTC_AS_HEADER_QUADS * 4 + i] = std::bit_cast<uint32_t>(grids[i].origin);
        out[RTC_AS_HEADER_QUADS * 4 + 4 + i] = std::bit_cast<uint32_t>(grids[i].step);
    }
    uint32_t* small = out + (RTC_AS_HEADER_QUADS + kGridQuads) * 4;
    for (uint32_t n = 0; n < nodes; ++n, node += RTC_NODE_QUADS * 4, small += kSmallNodeQuads * 4) {
        const Cells children[2] = {cells_of(grids, node, node + 4), cells_of(grids, node + 8, node + 12)};
        bits == 16 ? write_16(children, small) : write_8(children, small);
        small[3] = node[3];
        small[7] = node[7];
    }
    return at;
}

}  // namespace

HostScene with_small_boxes(const HostScene& scene, int bits) {
    HostScene small = scene;
    small.heap.assign(RTC_AS_ALIGNMENT / 4, 0u);
    std::map<uint32_t, uint32_t> moved;  // bottom levels
    const uint32_t* top = &scene.heap[size_t(scene.root) * 4];
    const uint32_t count = top[RTC_HDR_SLOT_COUNT];
    const uint32_t* record = top + top[RTC_HDR_SLOTS] * 4;
    for (uint32_t i = 0; i < count; ++i, record += RTC_INSTANCE_QUADS * 4)
        if (!moved.count(record[24])) {
            const uint32_t at = copy_small(scene.heap, record[24], bits, small.heap);
            moved[record[24]] = at;
        }
    small.root = copy_small(scene.heap, scene.root, bits, small.heap);
    uint32_t* copied = &small.heap[size_t(small.root) * 4];
    copied += copied[RTC_HDR_SLOTS] * 4;
    for (uint32_t i = 0; i < count; ++i, copied += RTC_INSTANCE_QUADS * 4) {
        copied[24] = moved.at(copied[24]);
        const uint32_t* bottom = &small.heap[size_t(copied[24]) * 4];
        copied[29] = bottom[RTC_HDR_SLOTS];
        copied[30] = bottom[RTC_HDR_NODES];
    }
    return small;
}

HostScene with_float_inverse(const HostScene& scene) {
    HostScene rough = scene;
    uint32_t* record = &rough.heap[size_t(rough.root) * 4];
    record += record[RTC_HDR_SLOTS] * 4;
    for (const Instance& instance : scene.instances) {
        const Transform& m = instance.object_to_world;
        float cofactors[3][3];
        for (int r = 0; r < 3; ++r)
            for (int c = 0; c < 3; ++c) {
                const int r1 = (c + 1) % 3, r2 = (c + 2) % 3, c1 = (r + 1) % 3, c2 = (r + 2) % 3;
                cofactors[r][c] = m[r1][c1] * m[r2][c2] - m[r1][c2] * m[r2][c1];
            }
        const float det = (m[0][0] * cofactors[0][0] + m[0][1] * cofactors[1][0]) + m[0][2] * cofactors[2][0];
        for (int r = 0; r < 3; ++r) {
            float w[3];
            for (int c = 0; c < 3; ++c) w[c] = cofactors[r][c] / det;
            const float shift = -((w[0] * m[0][3] + w[1] * m[1][3]) + w[2] * m[2][3]);
            for (int c = 0; c < 3; ++c) record[r * 4 + c] = std::bit_cast<uint32_t>(w[c]);
            record[r * 4 + 3] = std::bit_cast<uint32_t>(shift);
        }
        record += RTC_INSTANCE_QUADS * 4;
    }
    return rough;
}

}  // namespace rtc::lab
