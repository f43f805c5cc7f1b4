#version 450
#extension GL_GOOGLE_include_directive : require
// Indirect launches: the extents come from the device. A lane a parameter slot (tile and
// round): the slots were filled for the largest extents and are corrected here. An extent
// with more lanes than that is a launch error and traces nothing.
//   in_data from p.data_offset: width, height, depth; state: the slots; dst_header: the
//   control block; p.count slots of p.data_stride words, p.step rounds a tile, p.total
//   lanes a tile, p.blocks lanes a workgroup, p.window_count lanes of the launch.
#include "common.glsl"

void main() {
    uint slot = lane_index();
    if (slot >= p.count) return;
    uvec3 size = uvec3(in_data[p.data_offset >> 2], in_data[(p.data_offset >> 2) + 1u],
                       in_data[(p.data_offset >> 2) + 2u]);
    // 32-bit products that overflow would pass for small launches.
    uint hi, lo, lanes = 0u;
    bool fits = true;
    uvec3 tiles = uvec3(size.x / 8u + (size.x % 8u != 0u ? 1u : 0u), size.y / 4u + (size.y % 4u != 0u ? 1u : 0u), size.z);
    umulExtended(tiles.x, tiles.y, hi, lo);
    fits = fits && hi == 0u;
    umulExtended(lo, tiles.z, hi, lo);
    fits = fits && hi == 0u && lo < 0x08000000u;
    uint tiled = fits ? lo * 32u : 0xffffffffu;
    bool fits_rows = size.x < 0xffffffe0u;
    umulExtended((size.x + 31u) & 0xffffffe0u, size.y, hi, lo);
    fits_rows = fits_rows && hi == 0u;
    umulExtended(lo, size.z, hi, lo);
    uint rows = fits_rows && hi == 0u ? lo : 0xffffffffu;
    bool tile_8x4 = tiled <= rows && size.y > 1u;
    lanes = tile_8x4 ? tiled : rows;
    if (lanes > p.window_count) {
        if (slot == 0u) {
            dst_header[RTC_CTRL_ERROR] = RTC_LAUNCH_ERROR_UNFINISHED;
            dst_header[RTC_CTRL_ERROR_COUNT] = 1u;
            dst_header[RTC_CTRL_ERROR_DETAIL] = lanes;
            dst_header[RTC_CTRL_SUSPENDED] = lanes;
        }
        lanes = 0u;
    }
    lanes = (lanes + p.blocks - 1u) / p.blocks * p.blocks;
    uint base = slot / p.step * p.total;
    uint at = slot * p.data_stride;
    state[at + RTC_PARAM_WIDTH] = size.x;
    state[at + RTC_PARAM_HEIGHT] = size.y;
    state[at + RTC_PARAM_DEPTH] = size.z;
    state[at + RTC_PARAM_LANE_COUNT] = lanes > base ? min(lanes - base, p.total) : 0u;
    state[at + RTC_PARAM_FLAGS] = (state[at + RTC_PARAM_FLAGS] & ~RTC_LAUNCH_TILE_8X4) | (tile_8x4 ? RTC_LAUNCH_TILE_8X4 : 0u);
}
