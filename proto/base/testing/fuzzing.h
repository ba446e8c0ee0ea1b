// What fuzzers share: how they fail, and the files that they write for what they test.
#pragma once

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <initializer_list>
#include <iostream>
#include <iterator>
#include <string>
#include <string_view>

#include "proto/base/bytes.h"
#include "proto/base/reason.h"

namespace relmap::fuzzing {

// Ends the process unless `holds`: libFuzzer then keeps the input, and a replay of the corpus fails.
inline void must(bool holds, std::string_view what = "what must hold does not") {
  if (holds) return;
  std::cerr << what << "\n";
  std::abort();
}

inline bool is_one_of(Reason reason, std::initializer_list<Reason> reasons) {
  return std::find(reasons.begin(), reasons.end(), reason) != reasons.end();
}

inline std::string_view text_of(ByteSpan bytes) { return {reinterpret_cast<const char*>(bytes.data()), bytes.size()}; }

// At most so many bytes of what remains: a length that is too large takes the rest, so that most changes of an input
// leave it one that says something.
inline ByteSpan take_up_to(ByteReader& in, std::size_t count) { return in.get_bytes(std::min(count, in.remaining())); }

inline Bytes read_file(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}
inline void write_file(const std::filesystem::path& path, ByteSpan bytes) {
  std::ofstream out(path, std::ios::binary | std::ios::trunc);
  out.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  must(out.flush().good(), "a file of the fuzzer cannot be written");
}

}  // namespace relmap::fuzzing
