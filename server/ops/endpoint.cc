#include "server/ops/endpoint.h"

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>

namespace relmap::ops {

Status write_endpoint(const std::string& folder, const Endpoint& endpoint) {
  const std::string path = folder + "/endpoint", temporary = path + ".new";
  {
    std::ofstream file(temporary, std::ios::trunc);
    file << "socket " << endpoint.socket << "\n";
    if (!endpoint.address.empty()) file << "address " << endpoint.address << "\n";
    if (!endpoint.http.empty()) file << "http " << endpoint.http << "\n";
    file << "pid " << endpoint.pid << "\nboot " << endpoint.boot_id << "\n";
    file.close();
    if (!file) return {Reason::IO_ERROR, "cannot write " + temporary + ": " + std::strerror(errno)};
  }
  std::error_code error;
  std::filesystem::rename(temporary, path, error);
  if (error) return {Reason::IO_ERROR, "cannot rename " + temporary + ": " + error.message()};
  return {};
}

void remove_endpoint(const std::string& folder) {
  std::error_code ignored;
  std::filesystem::remove(folder + "/endpoint", ignored);
  std::filesystem::remove(folder + "/endpoint.new", ignored);
}

}  // namespace relmap::ops
