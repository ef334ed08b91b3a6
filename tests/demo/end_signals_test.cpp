// The signals that end cumulet-demo.

#include <gtest/gtest.h>
#include <signal.h>  // NOLINT(modernize-deprecated-headers): signals of POSIX

#include <chrono>
#include <future>

#include "end_signals.hpp"

namespace {

using cumulet::demo::EndSignals;

TEST(EndSignalsTest, TheFirstSignalWakesTheProgram) {
  for (const int signal : {SIGTERM, SIGINT, SIGHUP}) {
    std::promise<void> woken;
    EndSignals signals([&] { woken.set_value(); });
    EXPECT_FALSE(signals.received());
    ASSERT_EQ(::raise(signal), 0);
    ASSERT_EQ(woken.get_future().wait_for(std::chrono::seconds(30)), std::future_status::ready);
    EXPECT_TRUE(signals.received());
  }
  struct sigaction now {};
  ASSERT_EQ(::sigaction(SIGTERM, nullptr, &now), 0);
  EXPECT_EQ(now.sa_handler, SIG_DFL) << "later signals end the program";
}

TEST(EndSignalsTest, IgnoredSignalsStayIgnored) {
  ::signal(SIGHUP, SIG_IGN);
  {
    const EndSignals signals([] {});
    ASSERT_EQ(::raise(SIGHUP), 0);
    EXPECT_FALSE(signals.received());
  }
  struct sigaction now {};
  ::sigaction(SIGHUP, nullptr, &now);
  EXPECT_EQ(now.sa_handler, SIG_IGN);
  ::signal(SIGHUP, SIG_DFL);
}

}  // namespace
