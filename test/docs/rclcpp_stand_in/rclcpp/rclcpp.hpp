// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// As much of rclcpp's interface as the example on docs/controllers.md uses: for a test of its types where rclcpp is not there.
#pragma once
#include <cstdio>
#include <memory>
#include <string>

#include <builtin_interfaces/msg/time.hpp>

namespace rclcpp
{
struct Logger {};

struct Duration
{
  double seconds() const {return 0.0;}
};

struct Time
{
  Time() = default;
  explicit Time(const builtin_interfaces::msg::Time &) {}
  Duration operator-(const Time &) const {return {};}
};

template<typename MessageT>
struct Subscription
{
  using SharedPtr = std::shared_ptr<Subscription<MessageT>>;
};

class Node
{
public:
  explicit Node(const std::string &) {}

  template<typename MessageT, typename CallbackT>
  typename Subscription<MessageT>::SharedPtr create_subscription(const std::string &, int, CallbackT callback)
  {
    callback(std::make_shared<const MessageT>());
    return std::make_shared<Subscription<MessageT>>();
  }

  Time now() const {return {};}
  Logger get_logger() const {return {};}
};

inline void init(int, char **) {}
inline void spin(std::shared_ptr<Node>) {}
inline void shutdown() {}
}  // namespace rclcpp

#define RCLCPP_INFO(logger, ...) do {(void)(logger); std::printf(__VA_ARGS__);} while (false)
