#include "frontend/capture/stereo_layout.h"

#include <string>
#include <vector>

#ifdef __SSE4_1__
#include <smmintrin.h>
#endif

namespace relmap::capture {

namespace {

// Operations on a row of words; `first` and `second` are the eyes in the order of their bytes.
struct PlainRows {
  static void split(const std::uint8_t* words, int width, std::uint8_t* first, std::uint8_t* second) {
    for (int x = 0; x < width; ++x) {
      first[x] = words[2 * x];
      second[x] = words[2 * x + 1];
    }
  }

  // [1 2 1] down.
  static void add_down(const std::uint8_t* above, const std::uint8_t* row, const std::uint8_t* below, int width,
                       std::uint16_t* first, std::uint16_t* second) {
    for (int x = 0; x < width; ++x) {
      first[x] = static_cast<std::uint16_t>(above[2 * x] + 2 * row[2 * x] + below[2 * x]);
      second[x] = static_cast<std::uint16_t>(above[2 * x + 1] + 2 * row[2 * x + 1] + below[2 * x + 1]);
    }
  }

  // [1 2 1] across, and a sixteenth of it; sums[-1] and sums[width] are there.
  static void add_across(const std::uint16_t* sums, int width, std::uint8_t* grey) {
    for (int x = 0; x < width; ++x)
      grey[x] = static_cast<std::uint8_t>((sums[x - 1] + 2 * sums[x] + sums[x + 1] + 8) >> 4);
  }
};

#ifdef __SSE4_1__

struct SseRows {
  static __m128i load(const void* p) { return _mm_loadu_si128(static_cast<const __m128i*>(p)); }
  static void store(void* p, __m128i value) { _mm_storeu_si128(static_cast<__m128i*>(p), value); }
  static __m128i low(__m128i words) { return _mm_and_si128(words, _mm_set1_epi16(0xff)); }
  static __m128i high(__m128i words) { return _mm_srli_epi16(words, 8); }
  static __m128i weighted(__m128i before, __m128i middle, __m128i after) {
    return _mm_add_epi16(_mm_add_epi16(before, after), _mm_slli_epi16(middle, 1));
  }

  static void split(const std::uint8_t* words, int width, std::uint8_t* first, std::uint8_t* second) {
    int x = 0;
    for (; x + 16 <= width; x += 16) {
      const __m128i a = load(words + 2 * x), b = load(words + 2 * x + 16);
      store(first + x, _mm_packus_epi16(low(a), low(b)));
      store(second + x, _mm_packus_epi16(high(a), high(b)));
    }
    PlainRows::split(words + 2 * x, width - x, first + x, second + x);
  }

  static void add_down(const std::uint8_t* above, const std::uint8_t* row, const std::uint8_t* below, int width,
                       std::uint16_t* first, std::uint16_t* second) {
    int x = 0;
    for (; x + 8 <= width; x += 8) {
      const __m128i a = load(above + 2 * x), b = load(row + 2 * x), c = load(below + 2 * x);
      store(first + x, weighted(low(a), low(b), low(c)));
      store(second + x, weighted(high(a), high(b), high(c)));
    }
    PlainRows::add_down(above + 2 * x, row + 2 * x, below + 2 * x, width - x, first + x, second + x);
  }

  static __m128i across(const std::uint16_t* sums) {
    const __m128i sum = weighted(load(sums - 1), load(sums), load(sums + 1));
    return _mm_srli_epi16(_mm_add_epi16(sum, _mm_set1_epi16(8)), 4);
  }
  static void add_across(const std::uint16_t* sums, int width, std::uint8_t* grey) {
    int x = 0;
    for (; x + 16 <= width; x += 16) store(grey + x, _mm_packus_epi16(across(sums + x), across(sums + x + 8)));
    PlainRows::add_across(sums + x, width - x, grey + x);
  }
};
using Rows = SseRows;

#else
using Rows = PlainRows;
#endif

// The sums of a row, with room for its mirrored ends.
class Sums {
 public:
  explicit Sums(int width) : sums_(static_cast<std::size_t>(width) + 2), width_(width) {}
  std::uint16_t* data() { return sums_.data() + 1; }
  void mirror_ends() {
    data()[-1] = data()[1];
    data()[width_] = data()[width_ - 2];
  }

 private:
  std::vector<std::uint16_t> sums_;
  int width_;
};

template <typename RowsOf>
void split(const StereoLayout& layout, const std::uint8_t* raw, vision::Image& first, vision::Image& second) {
  for (int y = 0; y < layout.height; ++y)
    RowsOf::split(raw + 2 * static_cast<std::ptrdiff_t>(layout.width) * y, layout.width, first.row(y), second.row(y));
}

template <typename RowsOf>
void split_and_smooth(const StereoLayout& layout, const std::uint8_t* raw, vision::Image& first,
                      vision::Image& second) {
  const int width = layout.width, last = layout.height - 1;
  const auto row = [&](int y) { return raw + 2 * static_cast<std::ptrdiff_t>(width) * y; };
  Sums sums_first(width), sums_second(width);
  for (int y = 0; y <= last; ++y) {
    RowsOf::add_down(row(y == 0 ? 1 : y - 1), row(y), row(y == last ? last - 1 : y + 1), width, sums_first.data(),
                     sums_second.data());
    sums_first.mirror_ends();
    sums_second.mirror_ends();
    RowsOf::add_across(sums_first.data(), width, first.row(y));
    RowsOf::add_across(sums_second.data(), width, second.row(y));
  }
}

Status check(const StereoLayout& layout, std::size_t bytes) {
  const std::string size = std::to_string(layout.width) + " x " + std::to_string(layout.height);
  const int min_side = layout.filter == ColourFilter::kNone ? 1 : 2;
  if (layout.width < min_side || layout.height < min_side)
    return {Reason::BAD_SIZE, "a stereo frame of " + size + " pixels"};
  if (bytes < layout.bytes())
    return {Reason::BAD_SIZE, "a frame of " + std::to_string(bytes) + " bytes; two eyes of " + size + " have " +
                                  std::to_string(layout.bytes())};
  return {};
}

void size_as(const StereoLayout& layout, vision::Image& picture) {
  if (picture.width() != layout.width || picture.height() != layout.height)
    picture = vision::Image(layout.width, layout.height);
}

template <typename RowsOf>
Status unpack_by(const StereoLayout& layout, std::span<const std::uint8_t> raw, vision::Image& left,
                 vision::Image& right) {
  if (Status status = check(layout, raw.size()); !status.ok()) return status;
  size_as(layout, left);
  size_as(layout, right);
  const bool left_first = layout.first_byte == FirstByte::kLeft;
  vision::Image &first = left_first ? left : right, &second = left_first ? right : left;
  if (layout.filter == ColourFilter::kNone)
    split<RowsOf>(layout, raw.data(), first, second);
  else
    split_and_smooth<RowsOf>(layout, raw.data(), first, second);
  return {};
}

}  // namespace

Status unpack(const StereoLayout& layout, std::span<const std::uint8_t> raw, vision::Image& left,
              vision::Image& right) {
  return unpack_by<Rows>(layout, raw, left, right);
}

Status detail::unpack_plainly(const StereoLayout& layout, std::span<const std::uint8_t> raw, vision::Image& left,
                              vision::Image& right) {
  return unpack_by<PlainRows>(layout, raw, left, right);
}

}  // namespace relmap::capture
