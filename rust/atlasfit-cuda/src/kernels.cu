// Kernels of atlasfit-cuda. Numbers are f32, indices 32 bits: launch.rs refuses what is larger. Parameters
// come in the order inputs, output, sizes, factors. Sums go in a fixed order, so that the same input gives
// the same bytes on one kind of GPU.

typedef unsigned int u32;

__device__ __forceinline__ u32 thread() { return blockIdx.x * blockDim.x + threadIdx.x; }

// ---- windows of convolutions (atlasfit_learn::ops::unfold) ----

// Numbers of a picture are taken one by one, or where channels allow it four at a time: counting where they
// lie takes longer than moving them.
__device__ __forceinline__ void add(float& sum, float x) { sum += x; }
__device__ __forceinline__ void add(float4& sum, float4 x) {
    sum.x += x.x, sum.y += x.y, sum.z += x.z, sum.w += x.w;
}

// A thread for each number of the result (count, high, wide, side side channels).
template <class Number>
__device__ __forceinline__ void unfold_of(const Number* x, Number* out, Number zero, u32 total, u32 rows,
                                          u32 columns, u32 channels, u32 high, u32 wide, u32 side,
                                          u32 stride) {
    u32 i = thread();
    if (i >= total) return;
    u32 channel = i % channels, rest = i / channels;
    u32 tap = rest % (side * side);
    rest /= side * side;
    u32 column = rest % wide * stride + tap % side - side / 2;
    rest /= wide;
    u32 row = rest % high * stride + tap / side - side / 2;
    u32 picture = rest / high;
    // Places before the picture wrap around to large numbers.
    bool inside = row < rows && column < columns;
    out[i] = inside ? x[((picture * rows + row) * columns + column) * channels + channel] : zero;
}

// The adjoint: a thread for each number of the picture adds what its windows hold of it.
template <class Number>
__device__ __forceinline__ void fold_of(const Number* d, Number* out, Number zero, u32 total, u32 rows,
                                        u32 columns, u32 channels, u32 high, u32 wide, u32 side, u32 stride) {
    u32 i = thread();
    if (i >= total) return;
    u32 channel = i % channels, rest = i / channels;
    u32 column = rest % columns + side / 2;
    rest /= columns;
    u32 row = rest % rows + side / 2;
    u32 picture = rest / rows;
    Number sum = zero;
    for (u32 a = 0; a < side; a++) {
        u32 y = row - a;
        if (row < a || y % stride || y / stride >= high) continue;
        for (u32 b = 0; b < side; b++) {
            u32 x = column - b;
            if (column < b || x % stride || x / stride >= wide) continue;
            u32 place = (picture * high + y / stride) * wide + x / stride;
            add(sum, d[(place * side * side + a * side + b) * channels + channel]);
        }
    }
    out[i] = sum;
}

#define WINDOWS u32 total, u32 rows, u32 columns, u32 channels, u32 high, u32 wide, u32 side, u32 stride
#define GIVEN total, rows, columns, channels, high, wide, side, stride

extern "C" __global__ void unfold(const float* x, float* out, WINDOWS) { unfold_of(x, out, 0.f, GIVEN); }

extern "C" __global__ void unfold_fours(const float4* x, float4* out, WINDOWS) {
    unfold_of(x, out, make_float4(0.f, 0.f, 0.f, 0.f), GIVEN);
}

extern "C" __global__ void fold(const float* d, float* out, WINDOWS) { fold_of(d, out, 0.f, GIVEN); }

extern "C" __global__ void fold_fours(const float4* d, float4* out, WINDOWS) {
    fold_of(d, out, make_float4(0.f, 0.f, 0.f, 0.f), GIVEN);
}

// ---- batch norm (atlasfit_learn::ops::norm) ----

// Blocks are 32 units wide and 8 rows high.
const u32 WIDE = 32, HIGH = 8;

// Adds the 8 rows' sums of a block; the first row then holds them.
__device__ __forceinline__ void add_rows(float& a, float& b) {
    __shared__ float both[2][HIGH][WIDE];
    both[0][threadIdx.y][threadIdx.x] = a;
    both[1][threadIdx.y][threadIdx.x] = b;
    __syncthreads();
    if (threadIdx.y) return;
    for (u32 y = 1; y < HIGH; y++) {
        a += both[0][y][threadIdx.x];
        b += both[1][y][threadIdx.x];
    }
}

// Writes the two sums of a block's rows, a run of its group's, for each of its units: out (2, runs, groups,
// units). Blocks: (units, runs, groups).
__device__ __forceinline__ void put_run(float a, float b, float* out, u32 groups, u32 group, u32 units,
                                        u32 unit) {
    add_rows(a, b);
    if (threadIdx.y || unit >= units) return;
    u32 at = (blockIdx.y * groups + group) * units + unit;
    out[at] = a;
    out[gridDim.y * groups * units + at] = b;
}

// For each unit of each group, over one run of its rows: the sums of the differences from the first row, and
// of their squares.
extern "C" __global__ void norm_moments(const float* x, float* out, u32 groups, u32 rows, u32 units,
                                        u32 run) {
    u32 unit = blockIdx.x * WIDE + threadIdx.x, group = blockIdx.z;
    float a = 0.f, b = 0.f;
    if (unit < units) {
        const float* of = x + group * rows * units + unit;
        float first = of[0];
        u32 end = min(rows, (blockIdx.y + 1) * run);
        for (u32 row = blockIdx.y * run + threadIdx.y; row < end; row += HIGH) {
            float d = of[row * units] - first;
            a += d;
            b += d * d;
        }
    }
    put_run(a, b, out, groups, group, units, unit);
}

// Parts (2, runs, all) added over the runs: out (2, all), as they are, or with x as mean and variance.
extern "C" __global__ void norm_total(const float* parts, const float* x, float* out, u32 all, u32 units,
                                      u32 rows, u32 runs, u32 as_moments) {
    u32 i = blockIdx.x * WIDE + threadIdx.x;
    float a = 0.f, b = 0.f;
    if (i < all)
        for (u32 run = threadIdx.y; run < runs; run += HIGH) {
            a += parts[run * all + i];
            b += parts[(runs + run) * all + i];
        }
    add_rows(a, b);
    if (threadIdx.y || i >= all) return;
    if (as_moments) {
        float first = x[i / units * rows * units + i % units];
        a /= rows;
        b = fmaxf(b / rows - a * a, 0.f);
        a += first;
    }
    out[i] = a;
    out[all + i] = b;
}

// `packed` (4, groups, units): mean, variance, gain, shift. out: the values, scaled, shifted, negative ones
// times slope.
extern "C" __global__ void norm_apply(const float* x, const float* packed, float* out, u32 total, u32 all,
                                      u32 rows, u32 units, float slope, float eps) {
    u32 i = thread();
    if (i >= total) return;
    u32 at = i / (rows * units) * units + i % units;
    float hat = (x[i] - packed[at]) * rsqrtf(packed[all + at] + eps);
    float y = hat * packed[2 * all + at] + packed[3 * all + at];
    out[i] = y > 0.f ? y : slope * y;
}

// Sums of the gradient before the slope, and of its product with the normalised values: as norm_moments.
extern "C" __global__ void norm_sums(const float* d, const float* x, const float* packed, float* out,
                                     u32 groups, u32 rows, u32 units, u32 run, float slope, float eps) {
    u32 unit = blockIdx.x * WIDE + threadIdx.x, group = blockIdx.z, all = groups * units;
    float a = 0.f, b = 0.f;
    if (unit < units) {
        u32 at = group * units + unit, from = group * rows * units + unit;
        float mean = packed[at], inverse = rsqrtf(packed[all + at] + eps);
        float gain = packed[2 * all + at], shift = packed[3 * all + at];
        u32 end = min(rows, (blockIdx.y + 1) * run);
        for (u32 row = blockIdx.y * run + threadIdx.y; row < end; row += HIGH) {
            float hat = (x[from + row * units] - mean) * inverse;
            float g = d[from + row * units];
            if (!(hat * gain + shift > 0.f)) g *= slope;
            a += g;
            b += g * hat;
        }
    }
    put_run(a, b, out, groups, group, units, unit);
}

// The gradient of the values; `sums` (2, groups, units) of norm_sums, divided here by `rows`; with `fixed`
// moments these are constants.
extern "C" __global__ void norm_gradient(const float* d, const float* x, const float* packed,
                                         const float* sums, float* out, u32 total, u32 all, u32 rows,
                                         u32 units, u32 fixed, float slope, float eps) {
    u32 i = thread();
    if (i >= total) return;
    u32 at = i / (rows * units) * units + i % units;
    float inverse = rsqrtf(packed[all + at] + eps), gain = packed[2 * all + at];
    float hat = (x[i] - packed[at]) * inverse;
    float g = d[i];
    if (!(hat * gain + packed[3 * all + at] > 0.f)) g *= slope;
    if (!fixed) g -= (sums[at] + hat * sums[all + at]) / rows;
    out[i] = g * gain * inverse;
}

// ---- pictures of twice the size (atlasfit_learn::ops::upsample) ----

// The farther one of the two lines that line i of the result is made of; the nearer one is i / 2.
__device__ __forceinline__ u32 farther(u32 i, u32 side) {
    u32 near = i / 2;
    if (i % 2) return near + 1 < side ? near + 1 : near;
    return near ? near - 1 : 0;
}

extern "C" __global__ void upsample(const float* x, float* out, u32 total, u32 side, u32 channels) {
    u32 i = thread();
    if (i >= total) return;
    u32 channel = i % channels, rest = i / channels;
    u32 column = rest % (2 * side);
    rest /= 2 * side;
    u32 row = rest % (2 * side);
    const float* of = x + rest / (2 * side) * side * side * channels + channel;
    u32 r[2] = {row / 2 * side, farther(row, side) * side}, c[2] = {column / 2, farther(column, side)};
    float a = .75f * of[(r[0] + c[0]) * channels] + .25f * of[(r[0] + c[1]) * channels];
    float b = .75f * of[(r[1] + c[0]) * channels] + .25f * of[(r[1] + c[1]) * channels];
    out[i] = .75f * a + .25f * b;
}

// The weight of line `of` in line i of the result, which may come twice at the border.
__device__ __forceinline__ float share(u32 i, u32 of, u32 side) {
    return (i / 2 == of ? .75f : 0.f) + (farther(i, side) == of ? .25f : 0.f);
}

extern "C" __global__ void upsample_adjoint(const float* d, float* out, u32 total, u32 side, u32 channels) {
    u32 i = thread();
    if (i >= total) return;
    u32 channel = i % channels, rest = i / channels;
    u32 column = rest % side;
    rest /= side;
    u32 row = rest % side;
    const float* of = d + rest / side * 4 * side * side * channels + channel;
    float sum = 0.f;
    for (u32 y = row ? 2 * row - 1 : 0; y < min(2 * row + 3, 2 * side); y++) {
        float line = 0.f;
        for (u32 x = column ? 2 * column - 1 : 0; x < min(2 * column + 3, 2 * side); x++)
            line += share(x, column, side) * of[(y * 2 * side + x) * channels];
        sum += share(y, row, side) * line;
    }
    out[i] = sum;
}

// ---- sums of rows (atlasfit_learn::ops::outer) ----

// Sums (groups, a, b, units) of each row of x (groups, a, units) with each of y (groups, b, units).
extern "C" __global__ void outer_add(const float* x, const float* y, float* out, u32 total, u32 a, u32 b,
                                     u32 units) {
    u32 i = thread();
    if (i >= total) return;
    u32 unit = i % units, rest = i / units;
    u32 row = rest / b;
    out[i] = x[row * units + unit] + y[(row / a * b + rest % b) * units + unit];
}

// From (outer, count, inner) the sums over the middle: a thread for each number of the result.
extern "C" __global__ void sum_middle(const float* d, float* out, u32 total, u32 count, u32 inner) {
    u32 i = thread();
    if (i >= total) return;
    const float* of = d + i / inner * count * inner + i % inner;
    float sum = 0.f;
    for (u32 k = 0; k < count; k++) sum += of[k * inner];
    out[i] = sum;
}

// ---- nearest points (atlasfit_learn::loss) ----

// For each of `n` points of each set the place, among all sets, of the nearest one of `m` others; set b is
// looked up among the others of set b. Each side may have fewer sets than there are, which are then taken in
// turn.
// Blocks: (points, sets).
const u32 TILE = 512;
extern "C" __global__ void nearest(const float* points, const float* others, u32* out, u32 n, u32 m, u32 sets,
                                   u32 other_sets) {
    __shared__ float tile[3][TILE];
    u32 i = thread(), b = blockIdx.y;
    const float* p = points + (b % sets * n + min(i, n - 1)) * 3;
    const float* q = others + b % other_sets * m * 3;
    float x = p[0], y = p[1], z = p[2], best = 3.4e38f;
    u32 at = 0;
    for (u32 from = 0; from < m; from += TILE) {
        u32 some = min(TILE, m - from);
        __syncthreads();
        for (u32 k = threadIdx.x; k < 3 * some; k += blockDim.x) tile[k % 3][k / 3] = q[3 * from + k];
        __syncthreads();
        #pragma unroll 4
        for (u32 k = 0; k < some; k++) {
            float dx = tile[0][k] - x, dy = tile[1][k] - y, dz = tile[2][k] - z;
            float far = dx * dx + dy * dy + dz * dz;
            if (far < best) best = far, at = from + k;
        }
    }
    if (i < n) out[b * n + i] = b % other_sets * m + at;
}

// Adds to each sample's sum (3 numbers in steps of 2^-32) its differences from the points that it is
// nearest to:
// whole numbers, so that the order does not matter.
extern "C" __global__ void chamfer_pulls(const float* samples, const float* points, const u32* nearest,
                                         unsigned long long* out, u32 total, u32 all_points) {
    u32 i = thread();
    if (i >= total) return;
    u32 sample = nearest[i], point = i % all_points;
    for (u32 k = 0; k < 3; k++) {
        float d = samples[3 * sample + k] - points[3 * point + k];
        atomicAdd(&out[3 * sample + k], (unsigned long long)llrintf(ldexpf(d, 32)));
    }
}

// The gradient of the Chamfer distance at each sample, from its nearest point and its sum of chamfer_pulls.
extern "C" __global__ void chamfer_gradient(const float* samples, const float* points, const u32* nearest,
                                            const long long* pulls, float* out, u32 total, float of_sample,
                                            float of_point) {
    u32 i = thread();
    if (i >= total) return;
    float d = samples[i] - points[3 * nearest[i / 3] + i % 3];
    out[i] = of_sample * d + of_point * ldexpf((float)pulls[i], -32);
}

// ---- Adam (atlasfit_learn::adam) ----

// Both moments (2, total) of a gradient.
extern "C" __global__ void adam_moments(const float* g, float* moments, u32 total, float first,
                                        float second) {
    u32 i = thread();
    if (i >= total) return;
    moments[i] = first * moments[i] + (1.f - first) * g[i];
    moments[total + i] = second * moments[total + i] + (1.f - second) * g[i] * g[i];
}

extern "C" __global__ void adam_move(const float* moments, float* x, u32 total, float size, float root,
                                     float eps) {
    u32 i = thread();
    if (i < total) x[i] -= size * moments[i] / (sqrtf(moments[total + i]) * root + eps);
}
