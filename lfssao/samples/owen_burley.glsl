// owen-burley, square, seed $SEED: point k of Sobol's sequence, shuffled and Owen-scrambled by a hash (Burley 2020).
// GLSL 4.00 or GLSL ES 3.10 (bitfieldReverse). sample_point(k) is point k of any number of points, k from 0.
const uint SAMPLE_KEYS[4] = uint[4]($KEYS);  // of xi_1, xi_2, a third number on (0, 1), and the order

uint sample_scrambled(uint x, uint key) {
    x = bitfieldReverse(x) + key;
    x ^= x * 0x6c50b47cu;
    x ^= x * 0xb82f1e52u;
    x ^= x * 0xc7afe638u;
    x ^= x * 0x8d22f6e6u;
    return bitfieldReverse(x);
}

// Coordinates on (0, 1) in units of 2^-32: divide by 2^32, or take the first 23 bits and a half as sample_point does.
uvec3 sample_cell(uint k) {
    uint index = sample_scrambled(k, SAMPLE_KEYS[3]);
    uvec3 word = uvec3(bitfieldReverse(index), 0u, 0u);
    uint y = 1u, z = 1u, last = 1u;  // direction numbers
    for (int bit = 0; bit < 32; ++bit) {
        if (((index >> bit) & 1u) != 0u) {
            word.y ^= y << (31 - bit);
            word.z ^= z << (31 - bit);
        }
        y = (2u * y) ^ y;
        uint next = bit == 0 ? 3u : (2u * z) ^ (4u * last) ^ last;
        last = bit == 0 ? 1u : z;
        z = next;
    }
    return uvec3(
        sample_scrambled(word.x, SAMPLE_KEYS[0]),
        sample_scrambled(word.y, SAMPLE_KEYS[1]),
        sample_scrambled(word.z, SAMPLE_KEYS[2])
    );
}

vec2 sample_point(uint k) {
    ivec2 cell = ivec2(sample_cell(k).xy >> 9);  // 2^23 cells a side
    return vec2(2 * cell + 1 - 8388608) / 8388608.0;
}
