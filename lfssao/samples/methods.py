"""All sampling methods by domain and name."""

from lfssao.samples import direct, square
from lfssao.samples.sets import DIMENSIONS, Method

METHODS: dict[str, dict[str, Method]] = {
    domain: {method.name: method for method in (*square.METHODS, *direct.METHODS) if method.domain == domain}
    for domain in DIMENSIONS
}
