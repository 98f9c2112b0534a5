"""From drawings to space: limbs and markers (2009 paper, s3.4-3.5), back-projection and foot contact (2010, s3.1.3)."""
