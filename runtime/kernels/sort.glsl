// Stable radix sort, RTR_SORT_BITS a pass: count, scan, scatter. A block is
// RTR_SORT_BLOCK pairs of one workgroup; no workgroup waits for another. Even passes go
// from A to B, odd ones back; after 8 passes the result is in A.
uvec2 sort_read(uint i) { return ((p.step / RTR_SORT_BITS) & 1u) == 0u ? pairs_a[i] : pairs_b[i]; }
void sort_write(uint i, uvec2 v) {
    if (((p.step / RTR_SORT_BITS) & 1u) == 0u) pairs_b[i] = v;
    else pairs_a[i] = v;
}
uint sort_digit(uvec2 v) { return (v.x >> p.step) & (RTR_SORT_BINS - 1u); }
