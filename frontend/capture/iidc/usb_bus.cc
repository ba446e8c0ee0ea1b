#include "frontend/capture/iidc/usb_bus.h"

#include <libusb.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "frontend/capture/iidc/identity.h"
#include "frontend/capture/iidc/registers.h"
#include "frontend/capture/iidc/usb_ids.h"
#include "frontend/capture/iidc/usb_stream.h"
#include "proto/base/mutex.h"

namespace relmap::iidc {

namespace {

// The upper 16 bits of a 48-bit address select the request; the others are its value and index.
constexpr std::uint8_t kRegisterRequest = 0x7f, kReadRegister = 0xc0, kWriteRegister = 0x40;
constexpr unsigned kAnswerMs = 1000;
constexpr timeval kEventsWait{0, 100'000};

Status of_open(int error) {
  switch (error) {
    case LIBUSB_ERROR_ACCESS:
      return {Reason::CAMERA_FORBIDDEN,
              "no permission to open it: tools/99-relmap-cameras.rules, copied to /etc/udev/rules.d, gives it to the "
              "group plugdev (docs/cameras.md)"};
    case LIBUSB_ERROR_NO_DEVICE:
    case LIBUSB_ERROR_NOT_FOUND:
      return {Reason::CAMERA_GONE, "the camera was unplugged"};
    case LIBUSB_ERROR_BUSY:
      return {Reason::CAMERA_BUSY, "another program has the camera's stream"};
    default:
      return {Reason::IO_ERROR, std::string("it cannot be opened: ") + libusb_error_name(error)};
  }
}

// libusb, the thread that handles its events, and notifications of devices that are plugged in and out.
class Context {
 public:
  static Result<std::shared_ptr<Context>> make() {
    libusb_context* usb = nullptr;
    if (const int error = libusb_init(&usb); error != LIBUSB_SUCCESS)
      return {Reason::UNSUPPORTED, std::string("USB cannot be used: ") + libusb_error_name(error)};
    return std::shared_ptr<Context>(new Context(usb));
  }
  ~Context() {
    ending_ = true;
    if (watches_) libusb_hotplug_deregister_callback(usb_, watch_);
    libusb_interrupt_event_handler(usb_);
    events_.join();
    libusb_exit(usb_);
  }

  libusb_context* usb() const { return usb_; }

  bool wait_for_change(std::chrono::milliseconds wait) {
    MutexLock lock(mutex_);
    return changed_.wait_for(mutex_, wait, [this]() RELMAP_REQUIRES(mutex_) { return changes_ != seen_; }) &&
           (seen_ = changes_, true);
  }

 private:
  explicit Context(libusb_context* usb) : usb_(usb) {
    const int events = LIBUSB_HOTPLUG_EVENT_DEVICE_ARRIVED | LIBUSB_HOTPLUG_EVENT_DEVICE_LEFT;
    watches_ =
        libusb_has_capability(LIBUSB_CAP_HAS_HOTPLUG) &&
        libusb_hotplug_register_callback(usb_, events, 0, LIBUSB_HOTPLUG_MATCH_ANY, LIBUSB_HOTPLUG_MATCH_ANY,
                                         LIBUSB_HOTPLUG_MATCH_ANY, &Context::changed, this, &watch_) == LIBUSB_SUCCESS;
    events_ = std::thread([this] {
      while (!ending_) {
        timeval wait = kEventsWait;
        if (libusb_handle_events_timeout_completed(usb_, &wait, nullptr) != LIBUSB_SUCCESS && !ending_)
          std::this_thread::sleep_for(std::chrono::microseconds(kEventsWait.tv_usec));
      }
    });
  }

  static int LIBUSB_CALL changed(libusb_context*, libusb_device*, libusb_hotplug_event, void* self) {
    auto& context = *static_cast<Context*>(self);
    const MutexLock lock(context.mutex_);
    ++context.changes_;
    context.changed_.notify_all();
    return 0;
  }

  libusb_context* const usb_;
  bool watches_ = false;
  libusb_hotplug_callback_handle watch_{};
  std::atomic<bool> ending_ = false;
  Mutex mutex_;
  ConditionVariable changed_;
  std::uint64_t changes_ RELMAP_GUARDED_BY(mutex_) = 0, seen_ RELMAP_GUARDED_BY(mutex_) = 0;
  std::thread events_;
};

struct Endpoint {
  int interface = 0;
  std::uint8_t address = 0;
};

// The camera's first bulk input endpoint.
std::optional<Endpoint> video_endpoint(libusb_device* device) {
  libusb_config_descriptor* config = nullptr;
  if (libusb_get_active_config_descriptor(device, &config) != LIBUSB_SUCCESS &&
      libusb_get_config_descriptor(device, 0, &config) != LIBUSB_SUCCESS)
    return std::nullopt;
  std::optional<Endpoint> found;
  for (int i = 0; i < config->bNumInterfaces && !found; ++i) {
    const libusb_interface& interface = config->interface[i];
    if (interface.num_altsetting < 1) continue;
    const libusb_interface_descriptor& setting = interface.altsetting[0];
    for (int e = 0; e < setting.bNumEndpoints && !found; ++e) {
      const libusb_endpoint_descriptor& endpoint = setting.endpoint[e];
      if ((endpoint.bmAttributes & 3) == LIBUSB_TRANSFER_TYPE_BULK && endpoint.bEndpointAddress & LIBUSB_ENDPOINT_IN)
        found = Endpoint{setting.bInterfaceNumber, endpoint.bEndpointAddress};
    }
  }
  libusb_free_config_descriptor(config);
  return found;
}

class UsbLink : public CameraLink {
 public:
  static Result<std::unique_ptr<UsbLink>> open(std::shared_ptr<Context> context, libusb_device* device) {
    libusb_device_handle* handle = nullptr;
    if (const int error = libusb_open(device, &handle); error != LIBUSB_SUCCESS) return of_open(error);
    std::unique_ptr<UsbLink> link(new UsbLink(std::move(context), handle));
    // A device that was just plugged in may have no configuration yet. Another configuration is not taken away from its
    // user.
    int configuration = 0;
    if (libusb_get_configuration(handle, &configuration) == LIBUSB_SUCCESS && configuration == 0)
      if (const int error = libusb_set_configuration(handle, 1); error != LIBUSB_SUCCESS) return of_open(error);
    return link;
  }
  ~UsbLink() override {
    stop();
    if (lost_) return;
    if (claimed_) libusb_release_interface(handle_, claimed_->interface);
    libusb_close(handle_);
  }

  Status read(std::uint64_t address, std::span<std::uint32_t> quadlets) override {
    std::array<std::uint8_t, 4 * kQuadlets> bytes;
    for (std::size_t at = 0; at < quadlets.size(); at += kQuadlets) {
      const std::span<std::uint32_t> part = quadlets.subspan(at, std::min(kQuadlets, quadlets.size() - at));
      if (Status status = control(kReadRegister, address + 4 * at, bytes.data(), 4 * part.size()); !status.ok())
        return status;
      for (std::size_t i = 0; i < part.size(); ++i)  // little-endian on USB
        part[i] = std::uint32_t{bytes[4 * i + 3]} << 24 | std::uint32_t{bytes[4 * i + 2]} << 16 |
                  std::uint32_t{bytes[4 * i + 1]} << 8 | bytes[4 * i];
    }
    return {};
  }

  Status write(std::uint64_t address, std::uint32_t quadlet) override {
    std::array<std::uint8_t, 4> bytes;
    for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<std::uint8_t>(quadlet >> (8 * i));
    return control(kWriteRegister, address, bytes.data(), bytes.size());
  }

  Status claim() override {
    if (claimed_) return {};
    const auto endpoint = video_endpoint(libusb_get_device(handle_));
    if (!endpoint) return {Reason::UNSUPPORTED, "the device has no endpoint that sends by bulk transfers"};
    if (const int error = libusb_claim_interface(handle_, endpoint->interface); error != LIBUSB_SUCCESS)
      return of_open(error);
    claimed_ = *endpoint;
    return {};
  }

  Status start(const StreamRequest& request) override {
    if (stream_) return {Reason::WRONG_STATE, "the camera's stream is received already"};
    if (Status status = claim(); !status.ok()) return status;
    auto stream = UsbStream::start(handle_, claimed_->address, request);
    if (!stream.ok()) return stream.status();
    stream_ = std::move(*stream);
    return {};
  }

  Result<RawFrame> next(std::chrono::milliseconds wait) override {
    if (!stream_) return {Reason::WRONG_STATE, "the camera's stream is not received"};
    return stream_->next(wait);
  }

  void stop() override {
    if (!stream_) return;
    if (stream_->stop()) {
      stream_.reset();
    } else {
      // A transfer was not completed: the memory that it may still write to, and its callback, must stay valid.
      (void)stream_.release();
      (void)new std::shared_ptr<Context>(context_);
      lost_ = true;
    }
  }

 private:
  static constexpr std::size_t kQuadlets = 16;  // of a transfer

  UsbLink(std::shared_ptr<Context> context, libusb_device_handle* handle)
      : context_(std::move(context)), handle_(handle) {}

  Status control(std::uint8_t type, std::uint64_t address, std::uint8_t* bytes, std::size_t size) {
    if (address >> 32 != kRegisterSpace >> 32)
      return {Reason::IO_ERROR, "an address that no register of USB cameras has: " + address_text(address)};
    const int got = libusb_control_transfer(handle_, type, kRegisterRequest, static_cast<std::uint16_t>(address),
                                            static_cast<std::uint16_t>(address >> 16), bytes,
                                            static_cast<std::uint16_t>(size), kAnswerMs);
    if (got == static_cast<int>(size)) return {};
    const std::string what =
        std::string(type == kReadRegister ? "reading" : "writing") + " register " + address_text(address);
    switch (got) {
      case LIBUSB_ERROR_NO_DEVICE:
        return {Reason::CAMERA_GONE, "the camera was unplugged"};
      case LIBUSB_ERROR_PIPE:
        return {Reason::IO_ERROR, what + ": the camera refuses it"};
      case LIBUSB_ERROR_TIMEOUT:
        return {Reason::IO_ERROR, what + ": no answer within a second"};
      default:
        return {Reason::IO_ERROR,
                what + ": " + (got < 0 ? libusb_error_name(got) : std::to_string(got) + " bytes were answered")};
    }
  }

  const std::shared_ptr<Context> context_;
  libusb_device_handle* const handle_;
  std::optional<Endpoint> claimed_;
  bool lost_ = false;  // a transfer was never completed
  std::unique_ptr<UsbStream> stream_;
};

class UsbBus : public CameraBus {
 public:
  UsbBus(std::shared_ptr<Context> context, std::vector<std::uint32_t> also)
      : context_(std::move(context)), also_(std::move(also)) {}

  std::string name() const override { return "usb"; }

  Result<std::vector<CameraAddress>> cameras() override {
    std::vector<CameraAddress> found;
    Status status = for_each([&](libusb_device* device) {
      found.push_back(look(device).first);
      return true;
    });
    if (!status.ok()) return status;
    return found;
  }

  Result<std::unique_ptr<CameraLink>> open(std::uint64_t guid) override {
    std::unique_ptr<UsbLink> opened;
    Status unusable;
    const Status status = for_each([&](libusb_device* device) {
      auto [address, link] = look(device);
      if (!address.usable.ok()) unusable = address.usable;
      if (!address.usable.ok() || address.guid != guid) return true;
      opened = std::move(link);
      return false;
    });
    if (opened) return std::unique_ptr<CameraLink>(std::move(opened));
    if (!status.ok()) return status;
    if (!unusable.ok()) return unusable;  // this device may be the camera; its identity cannot be read
    return {Reason::NO_CAMERA, "no such camera on USB"};
  }

  bool wait_for_change(std::chrono::milliseconds wait) override { return context_->wait_for_change(wait); }

 private:
  bool is_camera(libusb_device* device) const {
    libusb_device_descriptor descriptor;
    if (libusb_get_device_descriptor(device, &descriptor) != LIBUSB_SUCCESS) return false;
    const bool listed = descriptor.idVendor == kPointGrey &&
                        std::find(kPointGreyProducts.begin(), kPointGreyProducts.end(), descriptor.idProduct) !=
                            kPointGreyProducts.end();
    const std::uint32_t id = std::uint32_t{descriptor.idVendor} << 16 | descriptor.idProduct;
    return listed || std::find(also_.begin(), also_.end(), id) != also_.end();
  }

  // Calls a function for each device until it returns false.
  template <typename See>
  Status for_each(See see) {
    libusb_device** devices = nullptr;
    const ssize_t count = libusb_get_device_list(context_->usb(), &devices);
    if (count < 0)
      return {Reason::IO_ERROR,
              std::string("USB devices cannot be listed: ") + libusb_error_name(static_cast<int>(count))};
    for (ssize_t i = 0; i < count; ++i)
      if (is_camera(devices[i]) && !see(devices[i])) break;
    libusb_free_device_list(devices, 1);
    return {};
  }

  // Identifies a device by its ROM.
  std::pair<CameraAddress, std::unique_ptr<UsbLink>> look(libusb_device* device) {
    CameraAddress address;
    address.bus = name();
    address.place = "bus " + std::to_string(libusb_get_bus_number(device)) + ", device " +
                    std::to_string(libusb_get_device_address(device));
    auto link = UsbLink::open(context_, device);
    if (!link.ok()) {
      address.usable = link.status();
      return {address, nullptr};
    }
    if (!identify(**link, address)) return {address, nullptr};
    return {address, std::move(*link)};
  }

  const std::shared_ptr<Context> context_;
  const std::vector<std::uint32_t> also_;
};

}  // namespace

Result<std::shared_ptr<CameraBus>> open_usb_bus(std::vector<std::uint32_t> also) {
  auto context = Context::make();
  if (!context.ok()) return context.status();
  return std::shared_ptr<CameraBus>(std::make_shared<UsbBus>(std::move(*context), std::move(also)));
}

}  // namespace relmap::iidc
