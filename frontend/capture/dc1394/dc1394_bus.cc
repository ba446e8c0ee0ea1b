#include "frontend/capture/dc1394/dc1394_bus.h"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <thread>
#include <utility>
#include <vector>

#include "frontend/capture/dc1394/dc1394_link.h"
#include "frontend/capture/dc1394/firewire_nodes.h"
#include "frontend/capture/iidc/identity.h"
#include "proto/base/mutex.h"

namespace relmap::iidc {

namespace {

namespace fs = std::filesystem;
using namespace dc1394;

std::string program_of(const Dc1394Options& options) {
  if (!options.program.empty()) return options.program;
  if (const char* const given = std::getenv("RELMAP_CAMERA_1394"); given && *given) return given;
  std::error_code error;
  const fs::path folder = fs::read_symlink("/proc/self/exe", error).parent_path();
  const fs::path beside = folder / "relmap-camera-1394";  // in a build
  const fs::path installed = folder.parent_path() / "lib/relmap/relmap-camera-1394";
  return fs::exists(installed, error) && !fs::exists(beside, error) ? installed : beside;
}

// A process that only lists the cameras.
class Lister : private ProcessEvents {
 public:
  explicit Lister(RestartPause& pause) : pause_(pause) {}

  Result<std::vector<std::uint64_t>> guids(const std::string& program, const std::vector<std::string>& arguments) {
    const auto process = CameraProcess::start(program, arguments, *this);
    if (!process.ok()) return process.status();
    const auto answer = (*process)->ask(Request{});
    if (!answer.ok()) return answer.status();
    return std::vector(answer->values.begin(), answer->values.begin() + answer->count);
  }

 private:
  Status told(const Message&) override { return {Reason::CORRUPT, "a frame that nobody waits for"}; }
  void ended(const Status& why) override { pause_.crashed(why); }

  RestartPause& pause_;
};

class Dc1394Bus : public CameraBus {
 public:
  Dc1394Bus(std::string program, const Dc1394Options& options)
      : program_(std::move(program)), nodes_(options.nodes.empty() ? kFirewireNodes : options.nodes) {
    if (options.usb_too) arguments_.push_back("--usb-too");
  }

  std::string name() const override { return "1394"; }

  Result<std::vector<CameraAddress>> cameras() override {
    auto addresses = there();
    if (!addresses.ok()) return addresses;
    for (CameraAddress& address : *addresses)
      if (address.usable.ok()) identify_once(address);
    return addresses;
  }

  Result<std::unique_ptr<CameraLink>> open(std::uint64_t guid) override {
    const auto addresses = there();
    if (!addresses.ok()) return addresses.status();
    for (const CameraAddress& address : *addresses)
      if (address.guid == guid) {
        if (!address.usable.ok()) return address.usable;
        auto link = connect(guid);
        if (!link.ok()) return link.status();
        return std::unique_ptr<CameraLink>(std::move(*link));
      }
    return {Reason::NO_CAMERA, "no such camera on IEEE 1394"};
  }

  bool wait_for_change(std::chrono::milliseconds wait) override {
    std::this_thread::sleep_for(wait);
    return false;
  }

 private:
  // The list as far as it is known without a process for each camera.
  Result<std::vector<CameraAddress>> there() {
    std::vector<CameraAddress> addresses;
    if (!arguments_.empty()) {  // the kernel's list does not have cameras on USB
      if (Status status = pause_->allows_start(); !status.ok()) return status;
      const auto guids = Lister(*pause_).guids(program_, arguments_);
      if (!guids.ok()) return guids.status();
      for (const std::uint64_t guid : *guids) {
        CameraAddress address;
        address.guid = guid;
        addresses.push_back(std::move(address));
      }
    } else {
      const auto nodes = firewire_nodes(nodes_);
      if (!nodes.ok()) return nodes.status();
      for (const FirewireNode& node : *nodes) {
        if (!node.camera) continue;
        CameraAddress address;
        address.guid = node.guid;
        address.vendor = node.vendor;
        address.model = node.model;
        address.place = node.file;
        if (::access(node.file.c_str(), R_OK | W_OK) != 0 && errno == EACCES)
          address.usable = {Reason::CAMERA_FORBIDDEN, "no permission to open " + node.file +
                                                          ": tools/99-relmap-cameras.rules, copied to "
                                                          "/etc/udev/rules.d, gives it to the group plugdev "
                                                          "(docs/cameras.md)"};
        addresses.push_back(std::move(address));
      }
    }
    for (CameraAddress& address : addresses) {
      address.serial = guid_text(address.guid);
      address.bus = name();
    }
    return addresses;
  }

  Result<std::unique_ptr<Dc1394Link>> connect(std::uint64_t guid) {
    if (Status status = pause_->allows_start(); !status.ok()) return status;
    auto link = std::make_unique<Dc1394Link>(pause_);
    if (Status status = link->open(program_, arguments_, guid); !status.ok()) return status;
    return link;
  }

  // The identity of a camera does not change, so it is read only once.
  void identify_once(CameraAddress& address) {
    {
      const MutexLock lock(mutex_);
      if (const auto known = known_.find(address.guid); known != known_.end()) {
        address.serial = known->second.serial;
        address.vendor = known->second.vendor;
        address.model = known->second.model;
        if (address.place.empty()) address.place = known->second.place;
        return;
      }
    }
    const std::uint64_t guid = address.guid;
    const auto link = connect(guid);
    if (!link.ok()) {
      address.usable = link.status();
      return;
    }
    if (address.place.empty()) address.place = (*link)->place();
    if (!identify(**link, address)) return;
    const MutexLock lock(mutex_);
    known_[guid] = address;
  }

  const std::string program_, nodes_;
  std::vector<std::string> arguments_;
  const std::shared_ptr<RestartPause> pause_ = std::make_shared<RestartPause>();
  Mutex mutex_;
  std::map<std::uint64_t, CameraAddress> known_ RELMAP_GUARDED_BY(mutex_);  // by GUID
};

}  // namespace

Result<std::shared_ptr<CameraBus>> open_dc1394_bus(const Dc1394Options& options) {
  std::string program = program_of(options);
  if (::access(program.c_str(), X_OK) != 0)
    return {Reason::UNSUPPORTED, "IEEE 1394 is served by " + program + ", which is not installed"};
  return std::shared_ptr<CameraBus>(std::make_shared<Dc1394Bus>(std::move(program), options));
}

}  // namespace relmap::iidc
