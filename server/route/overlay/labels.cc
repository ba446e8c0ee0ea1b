#include "server/route/overlay/labels.h"

#include <algorithm>
#include <bit>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace relmap::route {
namespace {

double relax_portably(const float* floors, const std::uint16_t* rests, double cost, std::uint64_t from,
                      const double* other, Labels& labels, std::size_t begin) {
  double whole = kUnreachable;
  for (std::size_t j = begin; j < labels.cost.size(); ++j) {
    if (cost + double{floors[j]} >= labels.cost[j]) continue;
    const double way = cost + SplitCostMatrix::joined(floors[j], rests[j]);
    if (way >= labels.cost[j]) continue;
    labels.cost[j] = labels.pending[j] = way;
    labels.came[j] = from;
    labels.min_pending = std::min(labels.min_pending, way);
    whole = std::min(whole, way + other[j]);
  }
  return whole;
}

void take_portably(double until, Labels& labels, std::vector<std::uint32_t>& nodes, std::size_t begin) {
  double min_pending = labels.min_pending;
  for (std::size_t j = begin; j < labels.pending.size(); ++j) {
    double& pending = labels.pending[j];
    if (pending <= until) {
      pending = kUnreachable;
      nodes.push_back(static_cast<std::uint32_t>(j));
    } else {
      min_pending = std::min(min_pending, pending);
    }
  }
  labels.min_pending = min_pending;
}

#if defined(__x86_64__)
__attribute__((target("avx2"))) double min_of(__m256d values) {
  alignas(32) double each[4];
  _mm256_store_pd(each, values);
  return std::min(std::min(each[0], each[1]), std::min(each[2], each[3]));
}

__attribute__((target("avx2"))) double relax_avx2(const float* floors, const std::uint16_t* rests, double cost,
                                                  std::uint64_t from, const double* other, Labels& labels) {
  const std::size_t n = labels.cost.size();
  const __m256d costs = _mm256_set1_pd(cost), never = _mm256_set1_pd(kUnreachable);
  const __m128 exponent = _mm_castsi128_ps(_mm_set1_epi32(SplitCostMatrix::kExponentBits));
  const __m256d rest_unit = _mm256_set1_pd(SplitCostMatrix::kRestUnit);
  const __m256i origin = _mm256_set1_epi64x(static_cast<long long>(from));
  __m256d whole = never, min_pending = never;
  std::size_t j = 0;
  for (; j + 4 <= n; j += 4) {
    const __m128 single = _mm_loadu_ps(floors + j);
    const __m256d floor = _mm256_cvtps_pd(single);
    const __m256d known = _mm256_loadu_pd(labels.cost.data() + j);
    if (_mm256_movemask_pd(_mm256_cmp_pd(_mm256_add_pd(costs, floor), known, _CMP_LT_OQ)) == 0) continue;
    // NaN where the floor is infinite, which compares as not better.
    const __m256d unit = _mm256_mul_pd(_mm256_cvtps_pd(_mm_and_ps(single, exponent)), rest_unit);
    const __m128i units = _mm_cvtepu16_epi32(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(rests + j)));
    const __m256d way = _mm256_add_pd(costs, _mm256_add_pd(floor, _mm256_mul_pd(unit, _mm256_cvtepi32_pd(units))));
    const __m256d better = _mm256_cmp_pd(way, known, _CMP_LT_OQ);
    _mm256_storeu_pd(labels.cost.data() + j, _mm256_blendv_pd(known, way, better));
    double* pending = labels.pending.data() + j;
    _mm256_storeu_pd(pending, _mm256_blendv_pd(_mm256_loadu_pd(pending), way, better));
    const __m256d if_better = _mm256_blendv_pd(never, way, better);
    min_pending = _mm256_min_pd(min_pending, if_better);
    whole = _mm256_min_pd(whole, _mm256_add_pd(if_better, _mm256_loadu_pd(other + j)));
    auto* came = reinterpret_cast<__m256i*>(labels.came.data() + j);
    _mm256_storeu_si256(came, _mm256_blendv_epi8(_mm256_loadu_si256(came), origin, _mm256_castpd_si256(better)));
  }
  labels.min_pending = std::min(labels.min_pending, min_of(min_pending));
  return std::min(min_of(whole), relax_portably(floors, rests, cost, from, other, labels, j));
}

__attribute__((target("avx2"))) void take_avx2(double until, Labels& labels, std::vector<std::uint32_t>& nodes) {
  const __m256d untils = _mm256_set1_pd(until), never = _mm256_set1_pd(kUnreachable);
  __m256d min_pending = never;
  std::size_t j = 0;
  for (; j + 4 <= labels.pending.size(); j += 4) {
    const __m256d pending = _mm256_loadu_pd(labels.pending.data() + j);
    const __m256d due = _mm256_cmp_pd(pending, untils, _CMP_LE_OQ);
    const __m256d rest = _mm256_blendv_pd(pending, never, due);
    min_pending = _mm256_min_pd(min_pending, rest);
    auto mask = static_cast<unsigned>(_mm256_movemask_pd(due));
    if (mask == 0) continue;
    _mm256_storeu_pd(labels.pending.data() + j, rest);
    for (; mask != 0; mask &= mask - 1)
      nodes.push_back(static_cast<std::uint32_t>(j) + static_cast<std::uint32_t>(std::countr_zero(mask)));
  }
  labels.min_pending = min_of(min_pending);
  take_portably(until, labels, nodes, j);
}
#endif

}  // namespace

Labels::Labels(std::size_t nodes)
    : block_(std::make_unique_for_overwrite<std::uint8_t[]>(nodes * (3 * sizeof(double) + 1))) {
  auto* costs = reinterpret_cast<double*>(block_.get());
  cost = {costs, nodes};
  pending = {costs + nodes, nodes};
  came = {reinterpret_cast<std::uint64_t*>(costs + 2 * nodes), nodes};
  settled = {block_.get() + 3 * nodes * sizeof(double), nodes};
  std::fill_n(costs, 2 * nodes, kUnreachable);
  std::ranges::fill(settled, std::uint8_t{0});
}

void take_pending(double until, Labels& labels, std::vector<std::uint32_t>& nodes) {
  nodes.clear();
  labels.min_pending = kUnreachable;
#if defined(__x86_64__)
  static const bool fast = __builtin_cpu_supports("avx2");
  if (fast) return take_avx2(until, labels, nodes);
#endif
  take_portably(until, labels, nodes, 0);
}

double relax_row(const float* floors, const std::uint16_t* rests, double cost, std::uint64_t from, const double* other,
                 Labels& labels) {
#if defined(__x86_64__)
  static const bool fast = __builtin_cpu_supports("avx2");
  if (fast) return relax_avx2(floors, rests, cost, from, other, labels);
#endif
  return relax_portably(floors, rests, cost, from, other, labels, 0);
}

}  // namespace relmap::route
