#include "server/service/service_manager.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

#include "storage/testing/temporary_folder.h"

namespace relmap::service {
namespace {

using std::chrono::milliseconds;
using ::testing::Contains;
using ::testing::Each;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

// systemd's end.
class ServiceManagerTest : public ::testing::Test {
 protected:
  ServiceManagerTest() : socket_(::socket(AF_UNIX, SOCK_DGRAM, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    const std::string path = folder_ / "notify";
    std::strncpy(address.sun_path, path.c_str(), sizeof address.sun_path - 1);
    EXPECT_EQ(bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    setenv("NOTIFY_SOCKET", path.c_str(), 1);
    setenv("WATCHDOG_USEC", "15000000", 1);
    setenv("WATCHDOG_PID", std::to_string(getpid()).c_str(), 1);
  }
  ~ServiceManagerTest() override {
    close(socket_);
    for (const char* name : {"NOTIFY_SOCKET", "WATCHDOG_USEC", "WATCHDOG_PID"}) unsetenv(name);
  }

  // The next message; empty if none comes for so long.
  std::string hear(milliseconds patience = std::chrono::minutes(10)) const {
    pollfd one{socket_, POLLIN, 0};
    if (poll(&one, 1, static_cast<int>(patience.count())) <= 0) return "";
    char text[4096];
    const ssize_t size = recv(socket_, text, sizeof text, 0);
    return {text, static_cast<std::size_t>(std::max<ssize_t>(size, 0))};
  }
  // All messages until one begins with this, which is the last.
  std::vector<std::string> hear_until(const std::string& begin) const {
    std::vector<std::string> heard;
    do {
      heard.push_back(hear());
    } while (!heard.back().empty() && !heard.back().starts_with(begin));
    return heard;
  }

  const storage::TemporaryFolder folder_;
  const int socket_;
  std::atomic<std::uint64_t> active_ = 0;
};

TEST_F(ServiceManagerTest, AsksForTimeOnlyAsLongAsTheStartMakesProgress) {
  const ServiceManager manager([this] { return active_ += 1000; }, milliseconds(1));
  EXPECT_THAT(hear(), StartsWith("STATUS=starting"));
  EXPECT_EQ(hear(), "EXTEND_TIMEOUT_USEC=30000000\n");
  EXPECT_EQ(hear(), "EXTEND_TIMEOUT_USEC=30000000\n");
}

TEST_F(ServiceManagerTest, AStartThatHangsIsGivenNoMoreTime) {
  const ServiceManager manager([] { return std::uint64_t{7}; }, milliseconds(1));
  EXPECT_THAT(hear(), StartsWith("STATUS=starting"));
  EXPECT_EQ(hear(milliseconds(200)), "") << "it was given time";
}

TEST_F(ServiceManagerTest, FeedsTheWatchdogAsLongAsTheDaemonLives) {
  std::atomic<bool> live = true;
  ServiceManager manager([] { return std::uint64_t{0}; }, milliseconds(1));
  manager.serves([&] { return ServiceManager::State{live, "42 keyframes; ok"}; });
  EXPECT_THAT(hear_until("READY=1"), Each(Not(HasSubstr("WATCHDOG"))));
  EXPECT_THAT(hear_until("STATUS=42 keyframes; ok\n"), Contains("WATCHDOG=1\n"));
  EXPECT_EQ(hear(), "WATCHDOG=1\n") << "a status is told once";
  live = false;
  while (!hear(milliseconds(300)).empty()) {
  }
  EXPECT_EQ(hear(milliseconds(100)), "") << "a daemon that hangs must not look alive";
  live = true;
  EXPECT_EQ(hear(), "WATCHDOG=1\n");
}

TEST_F(ServiceManagerTest, TellsOfReloadsAndOfTheStop) {
  std::vector<std::string> heard;
  {
    ServiceManager manager([] { return std::uint64_t{0}; }, milliseconds(1));
    manager.serves([] { return ServiceManager::State{}; });
    hear_until("READY=1");
    manager.reloads();
    EXPECT_THAT(hear_until("RELOADING=1").back(), HasSubstr("MONOTONIC_USEC="));
    manager.serves([] { return ServiceManager::State{}; });
    hear_until("READY=1");
    manager.stops();
    EXPECT_THAT(hear_until("STOPPING=1").back(), HasSubstr("STATUS=stopping"));
  }
  for (std::string message = hear(milliseconds(50)); !message.empty(); message = hear(milliseconds(50)))
    EXPECT_THAT(message, Not(HasSubstr("WATCHDOG=1"))) << "it stops";
}

TEST_F(ServiceManagerTest, TheWatchdogOfAnotherProcessIsNotFed) {
  setenv("WATCHDOG_PID", "1", 1);
  ServiceManager manager([] { return std::uint64_t{0}; }, milliseconds(1));
  manager.serves([] { return ServiceManager::State{true, "on"}; });
  hear_until("STATUS=on\n");
  EXPECT_EQ(hear(milliseconds(100)), "");
}

TEST_F(ServiceManagerTest, WhatTheDaemonStartsIsNotTheDaemon) {
  const ServiceManager manager([] { return std::uint64_t{0}; });
  EXPECT_EQ(std::getenv("NOTIFY_SOCKET"), nullptr);
  EXPECT_EQ(std::getenv("WATCHDOG_USEC"), nullptr);
}

TEST_F(ServiceManagerTest, WithoutAManagerNothingIsTold) {
  unsetenv("NOTIFY_SOCKET");
  ServiceManager manager;
  manager.serves([]() -> ServiceManager::State { throw std::logic_error("nobody asks"); });
  manager.stops();
}

TEST(ProcessActivity, GrowsWhileTheProcessWorks) {
  const std::uint64_t before = ServiceManager::process_activity();
  const auto until = std::chrono::steady_clock::now() + std::chrono::minutes(10);
  while (ServiceManager::process_activity() < before + 20 && std::chrono::steady_clock::now() < until) {
  }
  EXPECT_GE(ServiceManager::process_activity(), before + 20);
}

}  // namespace
}  // namespace relmap::service
