// Morton codes, 10 bits an axis, of the box centres; inactive primitives sort last.
uint spread(uint x) {
    x = (x * 0x00010001u) & 0xff0000ffu;
    x = (x * 0x00000101u) & 0x0f00f00fu;
    x = (x * 0x00000011u) & 0xc30c30c3u;
    x = (x * 0x00000005u) & 0x49249249u;
    return x;
}

uint morton_key(uint i) {
    vec4 a = leaf_box[2u * i];
    vec3 hi = leaf_box[2u * i + 1u].xyz;
    if (a.w == 0.0) return RTR_INACTIVE_KEY;
    vec3 c = 0.5 * a.xyz + 0.5 * hi;
    vec3 lo = vec3(order_decode(state[RTR_ST_CENTER_MIN]), order_decode(state[RTR_ST_CENTER_MIN + 1u]),
                   order_decode(state[RTR_ST_CENTER_MIN + 2u]));
    vec3 top = vec3(order_decode(state[RTR_ST_CENTER_MAX]), order_decode(state[RTR_ST_CENTER_MAX + 1u]),
                    order_decode(state[RTR_ST_CENTER_MAX + 2u]));
    // Halved, so that the extent of a scene near FLT_MAX stays finite. One scale for
    // all axes keeps the cells cubes, which is what the SAH wants.
    vec3 e = 0.5 * top - 0.5 * lo;
    float extent = max(e.x, max(e.y, e.z));
    vec3 q = vec3(0.0);
    if (extent > 0.0) q = ((0.5 * c - 0.5 * lo) / extent) * 1023.0;
    uvec3 u = uvec3(clamp(q, vec3(0.0), vec3(1023.0)));
    return (spread(u.x) << 2) | (spread(u.y) << 1) | spread(u.z);
}
