#include "tests/camera/usb_testbed.h"

#include <fcntl.h>
#include <linux/usbdevice_fs.h>
#include <sys/ioctl.h>
#include <umockdev.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstddef>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <thread>
#include <utility>

namespace relmap::testing {

namespace {

namespace fs = std::filesystem;

constexpr const char* kBus = "001";

std::string three_digits(int number) {
  char text[16];
  std::snprintf(text, sizeof text, "%03d", number);
  return text;
}

// A Chameleon's, which libdc1394 knows: one interface of the vendor's class, one bulk endpoint, 0x81.
std::string descriptors() {
  const unsigned char bytes[] = {
      18, 1, 0x00, 0x02, 0,    0,    0,    64,   0x10, 0x1e, 0x04, 0x20, 0, 1, 1, 2, 0, 1,  // device 1e10:2004
      9,  2, 25,   0,    1,    1,    0,    0x80, 250,                                       // configuration 1
      9,  4, 0,    0,    1,    0xff, 0xff, 0xff, 0,                                         // interface 0
      7,  5, 0x81, 2,    0x00, 0x02, 0,                                                     // bulk in, 512 bytes
  };
  return {reinterpret_cast<const char*>(bytes), sizeof bytes};
}

std::string text_or_throw(char* text) {
  if (!text) throw std::runtime_error("umockdev: no text");
  std::string copy = text;
  g_free(text);
  return copy;
}

// The memory of a client that a call points to; it is written back when the call is answered.
UMockdevIoctlData* pointed(UMockdevIoctlData* data, std::size_t offset, std::size_t size) {
  return umockdev_ioctl_data_resolve(data, offset, size, nullptr);
}

template <typename T>
T value_of(UMockdevIoctlData* data) {
  T value;
  std::memcpy(&value, data->data, sizeof value);
  return value;
}

std::shared_ptr<void> shared(UMockdevIoctlData* data) {
  return {data, [](void* object) { g_object_unref(object); }};
}

}  // namespace

class UsbTestbed::Bus {
 public:
  Bus() : testbed_(umockdev_testbed_new()), folder_(text_or_throw(umockdev_testbed_get_root_dir(testbed_))) {
    if (!umockdev_in_mock_environment()) {
      g_object_unref(testbed_);
      throw std::runtime_error("not under umockdev: call start_under_mock() first");
    }
  }
  ~Bus() { g_object_unref(testbed_); }
  Bus(const Bus&) = delete;
  Bus& operator=(const Bus&) = delete;

  UMockdevTestbed* testbed() const { return testbed_; }
  const std::string& folder() const { return folder_; }
  int next_number() { return ++devices_; }

 private:
  UMockdevTestbed* const testbed_;
  const std::string folder_;
  int devices_ = 0;
};

// A device file and who answers at it. Calls come in umockdev's own thread, which alone touches its objects.
struct UsbTestbed::Device {
  Device(Bus& bus_, std::shared_ptr<SimulatedCamera> camera_, const UsbTestbedOptions& options_, Access access)
      : bus(bus_), camera(std::move(camera_)), options(options_), number(bus.next_number()) {
    node = std::string("/dev/bus/usb/") + kBus + "/" + three_digits(number);
    name = std::string("1-") + std::to_string(number);
    const fs::path file = bus.folder() + node;
    fs::create_directories(file.parent_path());
    port = std::make_unique<UsbPort>(camera, file.string());
    if (access == Access::kNobody) forbid(file);
    handler = umockdev_ioctl_base_new();
    g_signal_connect(handler, "handle-ioctl", G_CALLBACK(&Device::on_call), this);
    g_signal_connect(handler, "client-connected", G_CALLBACK(&Device::on_open), this);
    attached = access != Access::kNobody;  // even an open() that fails would connect to it, for ever
    if (attached) umockdev_testbed_attach_ioctl(bus.testbed(), node.c_str(), handler, nullptr);
    announce();
  }

  ~Device() {
    unplug();
    g_signal_handlers_disconnect_by_data(handler, this);
    g_object_unref(handler);
  }

  // The superuser may open every file but some of /proc.
  static void forbid(const fs::path& file) {
    fs::remove(file);
    fs::create_symlink("/proc/sys/kernel/ostype", file);
  }

  // The binary descriptors first: add_device() takes texts only, and tells everybody at once.
  void announce() {
    const std::string path = "/sys/devices/" + name;
    fs::create_directories(bus.folder() + path);
    std::ofstream(bus.folder() + path + "/descriptors", std::ios::binary) << descriptors();
    const std::string device_number = std::to_string(number), digits = three_digits(number);
    sys_path = text_or_throw(umockdev_testbed_add_device(
        bus.testbed(), "usb", name.c_str(), nullptr, "busnum", "1", "devnum", device_number.c_str(), "speed", "480",
        "bConfigurationValue", "1", "bNumConfigurations", "1", "idVendor", "1e10", "idProduct", "2004", nullptr,
        "DEVTYPE", "usb_device", "DRIVER", "usb", "BUSNUM", kBus, "DEVNUM", digits.c_str(), "DEVNAME", node.c_str(),
        nullptr));
  }

  void unplug() {
    if (!port->plugged()) return;
    port->unplug();
    umockdev_testbed_uevent(bus.testbed(), sys_path.c_str(), "remove");
    umockdev_testbed_remove_device(bus.testbed(), sys_path.c_str());
    if (attached) umockdev_testbed_detach_ioctl(bus.testbed(), node.c_str(), nullptr);
    fs::remove(bus.folder() + node);
  }

  // Nothing but its end tells that a client has closed the file: umockdev's own property is never notified.
  static void on_open(UMockdevIoctlBase*, UMockdevIoctlClient* client, Device* device) {
    ++device->clients;
    g_object_weak_ref(G_OBJECT(client), &Device::on_close, device);
  }

  static void on_close(gpointer data, GObject* client) {
    auto* const device = static_cast<Device*>(data);
    device->port->closed_by(client);
    --device->clients;
  }

  static gboolean on_call(UMockdevIoctlBase*, UMockdevIoctlClient* client, Device* device) {
    const int answer = device->call(client, umockdev_ioctl_client_get_request(client));
    umockdev_ioctl_client_complete(client, answer < 0 ? -1 : answer, answer < 0 ? -answer : 0);
    return TRUE;
  }

  int call(UMockdevIoctlClient* client, unsigned long request) {
    UMockdevIoctlData* const argument = umockdev_ioctl_client_get_arg(client);
    switch (static_cast<unsigned>(request)) {
      case USBDEVFS_GET_CAPABILITIES:
        return capabilities(argument);
      case USBDEVFS_GET_SPEED:
        return 3;  // USB_SPEED_HIGH
      case USBDEVFS_SETCONFIGURATION:
        return port->set_configuration();
      case USBDEVFS_CLAIMINTERFACE:
      case USBDEVFS_DISCONNECT_CLAIM:
        return port->claim(client);
      case USBDEVFS_RELEASEINTERFACE:
        return port->release(client);
      case USBDEVFS_CLEAR_HALT:
      case USBDEVFS_RESETEP:
        return port->clear_halt();
      case USBDEVFS_RESET:
        return port->reset();
      case USBDEVFS_GETDRIVER:
      case USBDEVFS_IOCTL:  // of a driver of the kernel
        return -ENODATA;
      case USBDEVFS_SUBMITURB:
        return submit(client, argument);
      case USBDEVFS_REAPURBNDELAY:
        return reap(client, argument);
      case USBDEVFS_DISCARDURB:
        return port->discard(client, value_of<std::uint64_t>(argument));
      default:
        return -ENOTTY;
    }
  }

  int capabilities(UMockdevIoctlData* argument) const {
    UMockdevIoctlData* const answer = pointed(argument, 0, sizeof(std::uint32_t));
    if (!answer) return -EFAULT;
    std::uint32_t able = USBDEVFS_CAP_ZERO_PACKET | USBDEVFS_CAP_BULK_CONTINUATION | USBDEVFS_CAP_REAP_AFTER_DISCONNECT;
    if (!options.split_transfers) able |= USBDEVFS_CAP_NO_PACKET_SIZE_LIM | USBDEVFS_CAP_BULK_SCATTER_GATHER;
    std::memcpy(answer->data, &able, sizeof able);
    g_object_unref(answer);
    return 0;
  }

  int submit(UMockdevIoctlClient* client, UMockdevIoctlData* argument) {
    UMockdevIoctlData* const memory = pointed(argument, 0, sizeof(usbdevfs_urb));
    if (!memory) return -EFAULT;
    UsbTransfer transfer{client, memory->client_addr, shared(memory)};
    const auto urb = value_of<usbdevfs_urb>(memory);
    transfer.length = static_cast<std::size_t>(urb.buffer_length);
    if (urb.type == USBDEVFS_URB_TYPE_CONTROL) {
      UMockdevIoctlData* const buffer = pointed(memory, offsetof(usbdevfs_urb, buffer), transfer.length);
      if (!buffer || transfer.length < 8) return -EINVAL;
      const auto keep = shared(buffer);
      transfer.length -= 8;
      return port->submit_control(std::move(transfer), buffer->data, buffer->data + 8);
    }
    if (urb.type != USBDEVFS_URB_TYPE_BULK || urb.endpoint != 0x81) return -ENOENT;
    transfer.error_if_short = urb.flags & USBDEVFS_URB_SHORT_NOT_OK;
    transfer.continues = urb.flags & USBDEVFS_URB_BULK_CONTINUATION;
    return port->submit_bulk(std::move(transfer));
  }

  int reap(UMockdevIoctlClient* client, UMockdevIoctlData* argument) {
    UsbTransfer transfer;
    if (const int failed = port->reap(client, transfer)) return failed;
    auto* const memory = static_cast<UMockdevIoctlData*>(transfer.memory.get());
    auto urb = value_of<usbdevfs_urb>(memory);
    urb.status = transfer.status;
    urb.actual_length = static_cast<int>(transfer.actual);
    std::memcpy(memory->data, &urb, sizeof urb);
    const bool control = urb.type == USBDEVFS_URB_TYPE_CONTROL;
    if (!transfer.pieces.empty()) {
      const std::size_t header = control ? 8 : 0;
      UMockdevIoctlData* const buffer = pointed(memory, offsetof(usbdevfs_urb, buffer), header + transfer.actual);
      if (buffer) {
        transfer.copy_to(buffer->data + header);
        g_object_unref(buffer);
      }
    }
    UMockdevIoctlData* const pointer = pointed(argument, 0, sizeof(void*));
    if (!pointer) return -EFAULT;
    umockdev_ioctl_data_set_ptr(pointer, 0, memory);
    g_object_unref(pointer);
    return 0;
  }

  Bus& bus;
  const std::shared_ptr<SimulatedCamera> camera;
  const UsbTestbedOptions options;
  const int number;
  std::string node, name, sys_path;
  std::unique_ptr<UsbPort> port;
  UMockdevIoctlBase* handler = nullptr;
  bool attached = false;
  std::atomic<int> clients = 0;
};

UsbTestbed::UsbTestbed(UsbTestbedOptions options) : options_(options), bus_(std::make_unique<Bus>()) {}

UsbTestbed::~UsbTestbed() {
  for (const auto& each : devices_) each->unplug();
  // The last to close it may not have been heard yet.
  const auto open = [](const auto& each) { return each->clients > 0; };
  for (int i = 0; i < 1000 && std::any_of(devices_.begin(), devices_.end(), open); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  bus_.reset();  // ends the thread that calls the devices
}

UsbTestbed::Device& UsbTestbed::device(const std::shared_ptr<SimulatedCamera>& camera) const {
  const auto found =
      std::find_if(devices_.rbegin(), devices_.rend(), [&](const auto& each) { return each->camera == camera; });
  if (found == devices_.rend()) throw std::logic_error("this camera was never plugged in");
  return **found;
}

void UsbTestbed::plug(const std::shared_ptr<SimulatedCamera>& camera, Access access) {
  devices_.push_back(std::make_unique<Device>(*bus_, camera, options_, access));
}

void UsbTestbed::unplug(const std::shared_ptr<SimulatedCamera>& camera) { device(camera).unplug(); }

bool UsbTestbed::unplug_in_mid_frame(const std::shared_ptr<SimulatedCamera>& camera,
                                     std::chrono::milliseconds patience) {
  Device& plugged = device(camera);
  if (!plugged.port->wait_for_mid_frame(patience)) return false;
  plugged.unplug();
  return true;
}

UsbCounters UsbTestbed::counters(const std::shared_ptr<SimulatedCamera>& camera) const {
  return device(camera).port->counters();
}

const std::string& UsbTestbed::folder() const { return bus_->folder(); }

}  // namespace relmap::testing
