#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace knap {

/// A condition on the attributes of a point: range.keep.
///
///     or      = and { "||" and }
///     and     = factor { "&&" factor }
///     factor  = "!" factor | "(" or ")" | value compare number
///     value   = name [ "[" component "]" ]      component: 0, 1, ..
///     name    = letters, digits, "_" and "." not beginning with a digit, or any text in '"'
///     compare = "==" | "!=" | "<" | "<=" | ">" | ">="
///
/// Numbers are decimal, with sign and exponent; blanks may stand between words.
class KeepExpression {
  public:
    /// An attribute that is asked for.
    struct Variable {
        std::string name;
        std::size_t component = 0;
        friend bool operator==(const Variable&, const Variable&) = default;
    };

    /// @param text  as range.keep has it
    /// @throws ConfigError naming the column where it is wrong, what was expected and found
    explicit KeepExpression(std::string_view text);

    /// What values it wants, each once.
    const std::vector<Variable>& variables() const { return variables_; }

    /// @param values  one for each of variables(), in their order
    bool holds(std::span<const double> values) const { return holds(root_, values); }

  private:
    friend class KeepParser;

    enum class Kind { kAnd, kOr, kNot, kCompare };
    enum class Order { kEqual, kNotEqual, kLess, kLessEqual, kGreater, kGreaterEqual };

    struct Node {
        Kind kind = Kind::kCompare;
        std::size_t left = 0;   ///< kAnd, kOr, kNot: of nodes_
        std::size_t right = 0;  ///< kAnd, kOr
        Order order = Order::kEqual;
        std::size_t variable = 0;  ///< kCompare: of variables_
        double number = 0;
    };

    bool holds(std::size_t node, std::span<const double> values) const;
    static bool compare(double value, Order order, double number);

    std::vector<Variable> variables_;
    std::vector<Node> nodes_;
    std::size_t root_ = 0;
};

}  // namespace knap
