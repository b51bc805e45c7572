#include "keep/expression.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <optional>
#include <utility>

#include "knap/error.hpp"

namespace knap {

namespace {

// Deeper ones are no expression of a person, and each level takes some of the stack.
constexpr int kDeepest = 100;

bool is_letter(char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_' ||
           static_cast<unsigned char>(c) >= 0x80;
}

bool is_digit(char c) {
    return c >= '0' && c <= '9';
}

}  // namespace

/// Reads an expression from left to right.
class KeepParser {
  public:
    KeepParser(std::string_view text, KeepExpression& into) : text_(text), into_(into) {}

    void parse() {
        into_.root_ = parse_or();
        if (at_ < text_.size()) {
            fail("&&, || or the end");
        }
    }

  private:
    using Kind = KeepExpression::Kind;
    using Node = KeepExpression::Node;
    using Order = KeepExpression::Order;

    [[noreturn]] void fail(std::string_view expected) const {
        const std::string found = at_ < text_.size() ? fmt::format("\"{}\"", text_.substr(at_, 20))
                                                     : std::string("the end");
        throw ConfigError(fmt::format("range.keep (--keep): column {}: expected {}, found {}",
                                      at_ + 1, expected, found));
    }

    void skip_blanks() {
        while (at_ < text_.size() && (text_[at_] == ' ' || text_[at_] == '\t')) {
            ++at_;
        }
    }

    bool take(std::string_view word) {
        skip_blanks();
        if (!text_.substr(at_).starts_with(word)) {
            return false;
        }
        at_ += word.size();
        skip_blanks();
        return true;
    }

    std::size_t add(const Node& node) {
        into_.nodes_.push_back(node);
        return into_.nodes_.size() - 1;
    }

    std::size_t parse_or() {
        std::size_t left = parse_and();
        while (take("||")) {
            Node node;
            node.kind = Kind::kOr;
            node.left = left;
            node.right = parse_and();
            left = add(node);
        }
        return left;
    }

    std::size_t parse_and() {
        std::size_t left = parse_factor();
        while (take("&&")) {
            Node node;
            node.kind = Kind::kAnd;
            node.left = left;
            node.right = parse_factor();
            left = add(node);
        }
        return left;
    }

    std::size_t parse_factor() {
        if (++depth_ > kDeepest) {
            fail(fmt::format("at most {} parentheses and ! within each other", kDeepest));
        }
        std::size_t node = 0;
        if (take("!")) {
            Node negation;
            negation.kind = Kind::kNot;
            negation.left = parse_factor();
            node = add(negation);
        } else if (take("(")) {
            node = parse_or();
            if (!take(")")) {
                fail(")");
            }
        } else {
            node = parse_comparison();
        }
        --depth_;
        return node;
    }

    std::size_t parse_comparison() {
        KeepExpression::Variable variable{parse_name(), 0};
        if (take("[")) {
            variable.component = parse_component();
            if (!take("]")) {
                fail("]");
            }
        }
        Node node;
        node.order = parse_order();
        node.number = parse_number();
        auto& variables = into_.variables_;
        const auto known = std::find(variables.begin(), variables.end(), variable);
        node.variable = static_cast<std::size_t>(known - variables.begin());
        if (known == variables.end()) {
            variables.push_back(std::move(variable));
        }
        return add(node);
    }

    std::string parse_name() {
        skip_blanks();
        const std::size_t begin = at_;
        if (at_ < text_.size() && text_[at_] == '"') {
            const std::size_t end = text_.find('"', begin + 1);
            if (end == std::string_view::npos || end == begin + 1) {
                fail("a name between quotes");
            }
            at_ = end + 1;
            return std::string(text_.substr(begin + 1, end - begin - 1));
        }
        while (at_ < text_.size() &&
               (is_letter(text_[at_]) ||
                (at_ > begin && (is_digit(text_[at_]) || text_[at_] == '.')))) {
            ++at_;
        }
        if (at_ == begin) {
            fail("the name of an attribute, ! or (");
        }
        return std::string(text_.substr(begin, at_ - begin));
    }

    std::size_t parse_component() {
        std::size_t component = 0;
        const char* const begin = text_.data() + at_;
        const auto [end, error] = std::from_chars(begin, text_.data() + text_.size(), component);
        if (error != std::errc{}) {
            fail("a component: 0, 1, ..");
        }
        at_ += static_cast<std::size_t>(end - begin);
        return component;
    }

    Order parse_order() {
        // Longer ones before their beginnings.
        constexpr std::array<std::pair<std::string_view, Order>, 6> kOrders{
            {{"==", Order::kEqual},
             {"!=", Order::kNotEqual},
             {"<=", Order::kLessEqual},
             {">=", Order::kGreaterEqual},
             {"<", Order::kLess},
             {">", Order::kGreater}}};
        for (const auto& [word, order] : kOrders) {
            if (take(word)) {
                return order;
            }
        }
        fail("==, !=, <, <=, > or >=");
    }

    double parse_number() {
        skip_blanks();
        const std::size_t sign = at_ < text_.size() && text_[at_] == '+' ? 1 : 0;
        const char* const begin = text_.data() + at_ + sign;
        const char* const last = text_.data() + text_.size();
        double number = 0;
        const auto [end, error] = std::from_chars(begin, last, number);
        const bool ends_here = end == last || !(is_letter(*end) || is_digit(*end) || *end == '.');
        if (error != std::errc{} || !ends_here) {
            fail("a number");
        }
        at_ += sign + static_cast<std::size_t>(end - begin);
        return number;
    }

    std::string_view text_;
    KeepExpression& into_;
    std::size_t at_ = 0;
    int depth_ = 0;
};

KeepExpression::KeepExpression(std::string_view text) {
    KeepParser(text, *this).parse();
}

bool KeepExpression::holds(std::size_t node, std::span<const double> values) const {
    const Node& of = nodes_[node];
    switch (of.kind) {
        case Kind::kAnd:
            return holds(of.left, values) && holds(of.right, values);
        case Kind::kOr:
            return holds(of.left, values) || holds(of.right, values);
        case Kind::kNot:
            return !holds(of.left, values);
        case Kind::kCompare:
            break;
    }
    return compare(values[of.variable], of.order, of.number);
}

bool KeepExpression::compare(double value, Order order, double number) {
    switch (order) {
        case Order::kEqual:
            return value == number;
        case Order::kNotEqual:
            return value != number;
        case Order::kLess:
            return value < number;
        case Order::kLessEqual:
            return value <= number;
        case Order::kGreater:
            return value > number;
        case Order::kGreaterEqual:
            break;
    }
    return value >= number;
}

}  // namespace knap
