#include "frontend/capture/dc1394/firewire_nodes.h"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string_view>

namespace relmap::iidc::dc1394 {

namespace {

namespace fs = std::filesystem;

constexpr std::string_view kIidcUnit = "0x00a02d:";  // specifier:version

std::string attribute(const fs::path& node, const char* name) {
  std::ifstream in(node / name);
  std::string line;
  std::getline(in, line);
  return line;
}

bool is_node(const std::string& name) {  // "fw1"; its units are "fw1.0"
  return name.size() > 2 && name.starts_with("fw") &&
         std::all_of(name.begin() + 2, name.end(), [](char digit) { return digit >= '0' && digit <= '9'; });
}

}  // namespace

Result<std::vector<FirewireNode>> firewire_nodes(const std::string& folder) {
  std::error_code error;
  fs::directory_iterator entries(folder, error);
  if (error)
    return {Reason::UNSUPPORTED,
            "no IEEE 1394 in this machine: its kernel has no driver of an adapter (firewire-ohci)"};
  std::vector<FirewireNode> nodes;
  for (; !error && entries != fs::directory_iterator(); entries.increment(error)) {
    const fs::path& path = entries->path();
    if (!is_node(path.filename())) continue;
    FirewireNode node;
    node.guid = std::strtoull(attribute(path, "guid").c_str(), nullptr, 16);
    node.file = "/dev/" + path.filename().string();
    node.vendor = attribute(path, "vendor_name");
    node.model = attribute(path, "model_name");
    node.camera = attribute(path, "units").find(kIidcUnit) != std::string::npos;
    nodes.push_back(std::move(node));
  }
  // The adapter itself is a node.
  if (nodes.empty()) return {Reason::UNSUPPORTED, "no IEEE 1394 in this machine: it has no adapter"};
  std::sort(nodes.begin(), nodes.end(), [](const FirewireNode& a, const FirewireNode& b) { return a.file < b.file; });
  return nodes;
}

}  // namespace relmap::iidc::dc1394
