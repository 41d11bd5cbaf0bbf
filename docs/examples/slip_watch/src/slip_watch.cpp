// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <memory>

#include <rclcpp/rclcpp.hpp>
#include <tactile_msgs/msg/contacts.hpp>
#include <tactile_msgs/msg/slip.hpp>

using tactile_msgs::msg::Contacts;
using tactile_msgs::msg::Slip;

class SlipWatch : public rclcpp::Node
{
public:
  SlipWatch()
  : Node("slip_watch")
  {
    contacts_ = create_subscription<Contacts>("contacts", 10, [this](Contacts::ConstSharedPtr message) {take(*message);});
    slip_ = create_subscription<Slip>("slip", 10, [this](Slip::ConstSharedPtr message) {take(*message);});
  }

private:
  void take(const Contacts & message)
  {
    force_ = 0.0;
    for (const auto & contact : message.contacts) {
      force_ += contact.force;  // NaN, not known, stays NaN
    }
  }

  void take(const Slip & message)
  {
    if (message.state == Slip::NONE) {
      return;
    }
    const double age = (now() - rclcpp::Time(message.header.stamp)).seconds();
    RCLCPP_INFO(
      get_logger(), "%s slip, %.0f %% of the contact, %.0f ms ago, %s%.2f N", message.state == Slip::GROSS ? "gross" : "incipient",
      100.0 * message.slipping_fraction, 1e3 * age, std::isnan(force_) ? "force not known: " : "", force_);
  }

  double force_ = NAN;
  rclcpp::Subscription<Contacts>::SharedPtr contacts_;
  rclcpp::Subscription<Slip>::SharedPtr slip_;
};

int main(int argc, char ** argv)
{
  rclcpp::init(argc, argv);
  rclcpp::spin(std::make_shared<SlipWatch>());
  rclcpp::shutdown();
  return 0;
}
