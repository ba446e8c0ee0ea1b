#include "tools/bench/fleet/deeds.h"

#include <fcntl.h>
#include <unistd.h>

#include <chrono>
#include <fstream>
#include <stdexcept>

namespace relmap::bench {

std::int64_t monotonic_ns() { return std::chrono::steady_clock::now().time_since_epoch().count(); }

DeedLog::DeedLog(const std::string& file)
    : file_(::open(file.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644)) {
  if (file_ < 0) throw std::runtime_error("cannot write " + file);
}

DeedLog::~DeedLog() { ::close(file_); }

void DeedLog::add(const Deed& deed) const {
  if (::write(file_, &deed, sizeof deed) != sizeof deed) throw std::runtime_error("cannot write what robots did");
}

std::vector<Deed> read_deeds(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  std::vector<Deed> deeds;
  for (Deed deed; in.read(reinterpret_cast<char*>(&deed), sizeof deed);) deeds.push_back(deed);
  return deeds;
}

}  // namespace relmap::bench
