// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/method/overlap/weight_function.h"

#include <gtest/gtest.h>

using namespace kerf;

TEST(WeightFunction, ValuesAndEnds)
{
  EXPECT_DOUBLE_EQ(fe_weight(WeightFunction::linear, 0.25, 1.), 0.25);
  EXPECT_DOUBLE_EQ(fe_weight(WeightFunction::cubic, 0.25, 1.), 3. / 16. - 2. / 64.);
  EXPECT_DOUBLE_EQ(fe_weight(WeightFunction::constant, 0.25, 1.), 0.5);
  for (const WeightFunction function : {WeightFunction::linear, WeightFunction::cubic, WeightFunction::constant})
  {
    EXPECT_DOUBLE_EQ(fe_weight(function, 0., 1.), 0.);
    EXPECT_DOUBLE_EQ(fe_weight(function, 1., 1.), 1.);
  }
}
