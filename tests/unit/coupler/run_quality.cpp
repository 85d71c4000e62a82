// SPDX-License-Identifier: GPL-2.0-or-later
// The energy ledger's scale, and what a run is warned of.
#include "coupler/application/output/run_quality.h"

#include <gtest/gtest.h>

#include <functional>

using namespace kerf;

namespace
{
/// A sound cut: shares of the undamped disc cutter.
RunFigures sound()
{
  RunFigures figures;
  figures.broken = 1000;
  figures.early.bonds = 50;
  figures.at_border.bonds = 20;
  figures.energy.tool_work = figures.turnover = 200.;
  figures.energy.damping = 80.;
  figures.energy.kinetic = 8.;
  figures.energy.conversion_gain = 0.1;
  figures.energy.conversion = -0.6;
  return figures;
}
} // namespace

TEST(EnergyLedger, WhatConversionsDoIsNotPutIn)
{
  EnergyLedger ledger;
  ledger.initial = -3.;
  ledger.tool_work = 5.;
  ledger.boundary_work = -2.;
  ledger.conversion = 2000.;
  ledger.conversion_gain = 2010.;
  EXPECT_DOUBLE_EQ(ledger.turnover(), 7.);
  EXPECT_DOUBLE_EQ(ledger.changed_by_conversions(), 2020.); // 2010 created, 10 taken out
}

TEST(RunQuality, SoundRunIsNotWarned)
{
  EXPECT_TRUE(warnings(sound()).empty());
  EXPECT_TRUE(warnings(RunFigures()).empty()); // nothing happened
}

TEST(RunQuality, EachFigureHasItsWarning)
{
  const auto only = [](const std::function<void(RunFigures &)> &change)
  {
    RunFigures figures = sound();
    change(figures);
    const std::vector<std::string> lines = warnings(figures);
    EXPECT_EQ(lines.size(), 1u);
    return lines.empty() ? std::string() : lines[0];
  };
  EXPECT_NE(only(
              [](RunFigures &f) {
                f.early = {120, {0.01, 0.02, 0.}};
              })
              .find("12 % of the broken bonds (120 of 1000, around "
                    "(0.01, 0.02, 0) m) broke in the overlap"),
            std::string::npos);
  EXPECT_NE(only([](RunFigures &f) { f.at_border.bonds = 60; }).find("the particle region is smaller than the damage"),
            std::string::npos);
  EXPECT_NE(only([](RunFigures &f) { f.energy.damping = 110.; }).find("damping took 55 % of the tool's work"),
            std::string::npos);
  EXPECT_NE(only([](RunFigures &f) { f.energy.kinetic = 30.; }).find("inertia rules the force"), std::string::npos);
  EXPECT_NE(only([](RunFigures &f) { f.energy.conversion_gain = 0.5; }).find("conversions changed the energy by 0.8 %"),
            std::string::npos);
}

// A loaded body that a tool hardly touches: its damping is that of the loads.
TEST(RunQuality, LoadsMayBeDamped)
{
  RunFigures figures = sound();
  figures.energy.tool_work = 1.;
  EXPECT_TRUE(warnings(figures).empty());
}
