from hsv.base.processes import over_threads


def test_results_are_in_the_order_of_the_items_and_counted():
    counts = []
    assert over_threads(lambda item: item * item, range(20), counts.append) == [item * item for item in range(20)]
    assert counts == list(range(1, 21))
